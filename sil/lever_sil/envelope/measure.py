"""How right the estimates were, and whether the firmware said so: figures of a condition, a value for each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from lever_cdkf.firmware.estimator import DO_NOT_TRUST
from lever_cdkf.firmware.library import lib
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from numpy.typing import NDArray

from .. import measures
from ..acceptance import result as acceptance
from ..acceptance.excerpt import Excerpt
from ..acceptance.result import Values, largest, mean
from ..batch.firmware import PARAMETERS, RESPONSE_STRIDE, Feedthrough, Track
from ..batch.motions import Recording
from .condition import FOLLOWED

QUANTITIES = ("f_n", "zeta", *PARAMETERS)
WITHIN = 0.05
"""Settled is a natural frequency that stays within so much of the truth."""
_CALM = 0.5  # [s] without a flag: the firmware is back
_PENDING = 0.05  # [s] in which what was gathered before a flag may still be learnt


def fault_mask(*names: str) -> int:
    """Return the bits of these faults of the façade."""
    mask = 0
    for name in names:
        mask |= int(getattr(lib, f"LEVER_FAULT_{name}"))
    return mask


@dataclass(frozen=True)
class Outcome:
    """What happened in a condition and what the firmware made of it."""

    recording: Recording
    track: Track
    window: tuple[float, float]
    """Judged from and to [s]."""
    events: tuple[tuple[float, float], ...] = ()
    """Faults or changes, from and to [s]."""
    reference: Outcome | None = None
    """The same where it does not happen, or is given in the settings."""
    followed: float = FOLLOWED
    """So long after an event errors and settling are followed [s]."""

    def during(self, start: float, end: float) -> BoolArray:
        """Return which estimates are of this time [s]."""
        inside: BoolArray = (self.track.time >= start) & (self.track.time < end)
        return inside

    @cached_property
    def judged(self) -> BoolArray:
        """Which estimates are judged."""
        return self.during(*self.window)

    def error(self, quantity: str) -> FloatArray:
        """Estimate minus truth (times, runs)."""
        return self.track.value[quantity] - self.recording.truth[quantity]

    def deviation(self, quantity: str) -> FloatArray:
        """Return size of the error in standard deviations that the firmware states."""
        return np.abs(self.error(quantity)) / self.track.sigma[quantity]

    def flagged(self, mask: int = DO_NOT_TRUST) -> BoolArray:
        """Where the firmware shows any of these faults."""
        return measures.is_flagged(self.track.faults, mask)


def _percent(true: BoolArray, axis: int | tuple[int, ...] = 0) -> Values:
    share: Values = 100.0 * np.mean(true, axis=axis)
    return share


def _rms(quantity: str, outcome: Outcome) -> Values:
    relative = outcome.error(quantity) / outcome.recording.truth[quantity]
    percent: Values = 100.0 * measures.rms(relative[outcome.judged], axis=0)
    return percent


def _covered(quantity: str, outcome: Outcome) -> Values:
    error, sigma = outcome.error(quantity), outcome.track.sigma[quantity]
    percent: Values = 100.0 * measures.covered(error[outcome.judged], sigma[outcome.judged], axis=0)
    return percent


def _largest(quantity: str, outcome: Outcome) -> Values:
    largest: Values = outcome.deviation(quantity)[outcome.judged].max(axis=0)
    return largest


def _unflagged_deviation(outcome: Outcome) -> FloatArray:
    """Return largest error of any quantity in standard deviations, 0 with a fault of DO_NOT_TRUST (times, runs)."""
    worst = np.max([outcome.deviation(name)[outcome.judged] for name in QUANTITIES], axis=0)
    return np.where(outcome.flagged(DO_NOT_TRUST)[outcome.judged], 0.0, worst)


def _unflagged(outcome: Outcome) -> Values:
    greatest: Values = _unflagged_deviation(outcome).max(axis=0)
    return greatest


def _silent(outcome: Outcome) -> Values:
    """Return for how many seconds in a row estimates are wrong without a flag, at most."""
    wrong = _unflagged_deviation(outcome) > measures.WRONG
    step = outcome.track.time[1] - outcome.track.time[0]
    return np.array([step * measures.longest(each) for each in wrong.T])


def _silent_share(outcome: Outcome) -> Values:
    return _percent(_unflagged_deviation(outcome) > measures.WRONG)


def _changes(outcome: Outcome) -> Values:
    """Return the changes an hour; those that come while CHANGE still shows the last are not told from it."""
    shown = outcome.flagged(fault_mask("CHANGE"))[outcome.judged]
    hours = len(shown) * (outcome.track.time[1] - outcome.track.time[0]) / 3600.0
    rate: Values = np.sum(shown[1:] & ~shown[:-1], axis=0) / hours
    return rate


def _share(mask: int, outcome: Outcome) -> Values:
    return _percent(outcome.flagged(mask)[outcome.judged])


def _running(outcome: Outcome) -> Values:
    return _percent(outcome.track.mode[outcome.judged] == lib.LEVER_MODE_RUN)


def _settled(outcome: Outcome) -> Values:
    """From the end of the last event until the error stays small."""
    start = outcome.events[-1][1]
    after = outcome.during(start, start + outcome.followed)
    relative = (outcome.error("f_n") / outcome.recording.truth["f_n"])[after]
    settled = measures.settling_times(relative.T, outcome.track.time[after] - start, WITHIN)
    return np.where(np.isnan(settled), math.inf, settled)


def _lag(outcome: Outcome) -> Values:
    """By which c_p is late on a ramp: its mean error over its slope."""
    truth, time = outcome.recording.truth["c_p"][outcome.judged], outcome.track.time[outcome.judged]
    slope = (truth[-1] - truth[0]) / (time[-1] - time[0])
    lag: Values = -outcome.error("c_p")[outcome.judged].mean(axis=0) / slope
    return lag


def _until_flagged(mask: int, outcome: Outcome) -> Values:
    """From the begin of each event until one of the faults shows; the slowest."""
    delays = []
    for start, end in outcome.events:
        inside = outcome.during(start, end)
        shown = outcome.flagged(mask)[inside]
        delay = outcome.track.time[inside][shown.argmax(axis=0)] - start
        delays.append(np.where(shown.any(axis=0), delay, math.inf))
    slowest: Values = np.max(delays, axis=0)
    return slowest


def _back(outcome: Outcome) -> Values:
    """From the end of each event until the firmware learns again and shows no flag for a while; the slowest."""
    delays = []
    for _, end in outcome.events:
        after = outcome.during(end, end + outcome.followed)
        shown = outcome.flagged(DO_NOT_TRUST | fault_mask("SETTLING"))[after]
        time = outcome.track.time[after] - end
        calm = round(_CALM / (time[1] - time[0]))
        delays.append(time[0] + (time[1] - time[0]) * measures.first_without(shown.T, calm))
    slowest: Values = np.max(delays, axis=0)
    return slowest


def _learnt(within: float, outcome: Outcome) -> Values:
    """Return the greatest change of a parameter in an event, in its standard deviations.

    It is that `within` seconds after the begin of the event.
    """
    changes = [np.zeros(outcome.track.faults.shape[1])]
    for start, end in outcome.events:
        inside = outcome.during(start + within + _PENDING, end)
        if inside.any():
            value, sigma = (outcome.track.parameters(which)[inside] for which in ("value", "sigma"))
            changes.append(np.max(np.abs(value - value[0]) / sigma[0], axis=(0, 2)))
    greatest: Values = np.max(changes, axis=0)
    return greatest


def _against(compute: Callable[[Outcome], Values], outcome: Outcome) -> Values:
    """Return a figure over that of the reference."""
    if outcome.reference is None:
        raise ValueError("this condition has no reference")
    ratio: Values = compute(outcome) / compute(replace(outcome.reference, window=outcome.window))
    return ratio


def _relative_sigma(quantity: str, outcome: Outcome) -> Values:
    """Stated standard deviation, relative, mean over time."""
    relative = outcome.track.sigma[quantity] / outcome.track.value[quantity]
    mean: Values = relative[outcome.judged].mean(axis=0)
    return mean


def _sigma_ratio(outcome: Outcome) -> Values:
    ratios = [_against(partial(_relative_sigma, name), outcome) for name in PARAMETERS]
    widest: Values = np.max(ratios, axis=0)
    return widest


def _judged_feedthrough(outcome: Outcome) -> tuple[NDArray[np.complex128], Feedthrough]:
    """Return the true theta/z_ddot, and the firmware's at the judged times."""
    truth, stated = outcome.recording.response, outcome.track.feedthrough
    if truth is None or stated is None:
        raise ValueError("this condition has no theta/z_ddot")
    at = outcome.judged[::RESPONSE_STRIDE]
    return truth, Feedthrough(stated.response[at], stated.gain_sigma[at], stated.phase_sigma[at])


def _response_rms(outcome: Outcome) -> Values:
    """Over times and frequencies, relative to the rms of the truth over the band."""
    truth, stated = _judged_feedthrough(outcome)
    scale = np.sqrt(np.mean(np.abs(truth) ** 2, axis=-1, keepdims=True))
    percent: Values = 100.0 * measures.rms((stated.response - truth) / scale, axis=(0, 2))
    return percent


def _response_covered(outcome: Outcome) -> Values:
    """Return the share of times and frequencies at which both gain and phase are within ±2 sigma [%]."""
    truth, stated = _judged_feedthrough(outcome)
    ratio = truth / stated.response
    gain = np.abs(np.abs(ratio) - 1.0) <= 2.0 * stated.gain_sigma
    return _percent(gain & (np.abs(np.angle(ratio)) <= 2.0 * stated.phase_sigma), (0, 2))


def _pooled_rms(values: Values) -> float:
    return math.sqrt(float(np.mean(values**2)))


@dataclass(frozen=True)
class Figure(acceptance.Figure):
    """One way to measure an outcome."""

    compute: Callable[[Outcome], Values] = field(kw_only=True)


def _figure(
    unit: str,
    meaning: str,
    compute: Callable[[Outcome], Values],
    pool: Callable[[Values], float],
    more_is_worse: bool = True,
) -> Figure:
    return Figure(unit, meaning, pool, more_is_worse, compute=compute)


def _figures() -> dict[str, Figure]:
    figures, hands_off = {}, fault_mask("HANDS_OFF")
    for name in QUANTITIES:
        rms, ratio = partial(_rms, name), partial(_against, partial(_rms, name))
        figures[f"{name} rms"] = _figure("%", f"rms error of {name}", rms, _pooled_rms)
        figures[f"{name} covered"] = _figure(
            "%", f"share of time with the true {name} within ±2σ", partial(_covered, name), mean, False
        )
        figures[f"{name} largest"] = _figure("σ", f"largest error of {name}", partial(_largest, name), largest)
        figures[f"σ({name}) ratio"] = _figure(
            "1", f"σ of {name} ÷ that of the reference", partial(_against, partial(_relative_sigma, name)), mean
        )
        figures[f"{name} ratio"] = _figure("1", f"rms error of {name} ÷ that of the reference", ratio, _pooled_rms)
    return figures | {
        "flagged": _figure("%", "share of time with a fault that forbids trust", partial(_share, DO_NOT_TRUST), mean),
        "unflagged": _figure("σ", "largest error of a quantity without such a fault", _unflagged, largest),
        "silent": _figure("s", f"longest time with it above {measures.WRONG:g} σ", _silent, largest),
        "silent share": _figure("%", f"share of time with it above {measures.WRONG:g} σ", _silent_share, mean),
        "changes": _figure("1/h", "how often CHANGE begins", _changes, mean),
        **{
            f"{name} share": _figure("%", f"share of time with {name}", partial(_share, fault_mask(name)), mean)
            for name in ("CALIBRATION", "CHANGE", "EXCITATION", "MISMATCH")
        },
        "mismatch": _figure("%", "share of time with MISMATCH", partial(_share, fault_mask("MISMATCH")), mean, False),
        "running": _figure("%", "share of time in mode RUN", _running, mean, False),
        "settled": _figure("s", f"until f_n stays within {100 * WITHIN:g} %", _settled, largest),
        "lag": _figure("s", "delay with which c_p is followed", _lag, mean),
        "to flag": _figure("s", "until a fault shows", partial(_until_flagged, DO_NOT_TRUST), largest),
        "to HANDS_OFF": _figure("s", "until HANDS_OFF shows", partial(_until_flagged, hands_off), largest),
        "back": _figure("s", "until flags are off and learning goes on", _back, largest),
        "learnt at once": _figure("σ", "greatest change of a parameter in the event", partial(_learnt, 0.0), largest),
        "learnt": _figure("σ", "the same from 0.5 s after its begin on", partial(_learnt, 0.5), largest),
        "learnt late": _figure("σ", "the same from 2 s after its begin on", partial(_learnt, 2.0), largest),
        "σ ratio": _figure("1", "widest relative σ of a parameter ÷ that of the reference", _sigma_ratio, largest),
        "θ/z̈ rms": _figure("%", "complex rms error of theta/z_ddot over 2 to 8 Hz", _response_rms, _pooled_rms),
        "θ/z̈ covered": _figure("%", "share of it whose gain and phase are within ±2σ", _response_covered, mean, False),
    }


def excerpt(outcome: Outcome, points: int = 600) -> Excerpt:
    """Return the part of an outcome that a reader gets to see."""
    truth, run = outcome.recording.truth.get("f_n"), 0
    if truth is not None:
        run = int(np.argmax(_rms("f_n", outcome)))
    track = outcome.track
    at = np.arange(0, len(track.time), max(1, len(track.time) // points))
    return Excerpt(
        quantity="f_n",
        time=track.time[at],
        truth=np.empty(0) if truth is None else truth[at, run],
        value=track.value["f_n"][at, run],
        sigma=track.sigma["f_n"][at, run],
        flagged=outcome.flagged()[at, run],
    )


FIGURES: Mapping[str, Figure] = _figures()
