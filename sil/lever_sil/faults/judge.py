"""Whether the firmware kept what a row demands, and for how long it was wrong without a word."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from lever_cdkf.firmware.estimator import DO_NOT_TRUST
from lever_cdkf.firmware.library import enum_names, lib
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from .. import measures
from ..acceptance.excerpt import Excerpt
from ..batch.motions import PERIOD, STRIDE
from ..envelope.measure import QUANTITIES, fault_mask
from .bus import Interval
from .flight import Record

GONE = (
    *("THETA", "THETA_DOT", "TORQUE", "BASE", "GAP", "COMMUNICATION", "CLOCK", "SETTLING", "RECOVERED", "HANDS_OFF"),
)
"""With none of these the firmware is back: it learns. What its other verdicts remember is up to 20 s old."""
SILENT = 1.0
"""Wrong without a flag for so long [s] is too long,"""
RIGHT = 99.0
"""and so is less than this of the samples without a flag right [%]."""
BACK = 2.0
"""So long after a fault the firmware learns again [s]: it takes a second to settle after an outage."""
ERROR = 3.0
"""rms of f_n in the last AT_LAST [%]: that of a flight without a fault, and as much again for what was not learnt."""
UNHEARD = 20
"""Samples without an answer, from which on the silence of the bus is a flag."""
CALM = 0.5
"""[s] of estimating without a fault of GONE: the firmware is back."""
AT_LAST = 5.0
"""End of a flight that the error after a fault is of [s]."""


@dataclass(frozen=True)
class Requirement:
    """The demands of a row.

    Besides, of every row: estimates are finite and not wrong without a flag, each sample is answered, torque keeps
    within the gate's limits, and the firmware is back in the end.
    """

    flags: tuple[str, ...] = ()
    """One of these shows in the fault,"""
    within: int = 1
    """so many samples after its begin."""
    after: tuple[str, ...] = ()
    """One of these shows in the first two samples after its end."""
    unaffected: bool = False
    """Every estimate is that of a flight without the fault, bit for bit."""
    mode: tuple[str, ...] = ("run",)
    """That of the last sample in the fault."""
    torque_ends: float | None = None
    """Torque is zero from so long after its begin [s] to its end."""


@dataclass
class Verdict:
    """Of one flight."""

    measured: dict[str, float] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)
    excerpt: Excerpt | None = None
    """Of what was longest wrong without a flag."""

    def hold(self, name: str, value: float, most: float) -> None:
        """Note a figure and whether it keeps its limit; NaN does not."""
        self.measured[name] = value
        if not value <= most:
            self.broken.append(name)


def judge(
    requirement: Requirement, record: Record, plain: Record, truth: Mapping[str, FloatArray], time: Interval
) -> Verdict:
    """`plain` is the same flight without the fault."""
    verdict = Verdict()
    begin, end = (min(len(record.health), round(moment / PERIOD)) for moment in time)
    faults, modes = record.health["faults"], record.health["mode"]
    verdict.hold("not finite", _not_finite(record), 0)
    verdict.hold("unanswered", record.unanswered, 0)
    _judge_torque(requirement, record, begin, end, verdict)
    if requirement.unaffected:
        changed = np.count_nonzero(record.estimate.view(np.uint8) != plain.estimate.view(np.uint8))
        verdict.hold("estimates changed", float(changed), 0)
    if requirement.flags:
        shown = measures.is_flagged(faults[begin:end], fault_mask(*requirement.flags))
        verdict.hold("to flag", float(shown.argmax()) + 1 if shown.any() else math.inf, requirement.within)
    if requirement.after:
        shown = measures.is_flagged(faults[end : end + 3], fault_mask(*requirement.after))
        verdict.hold("to flag after", float(shown.argmax()) + 1 if shown.any() else math.inf, 2)
    mode = enum_names("lever_mode")[int(modes[end - 1])]
    if mode not in requirement.mode:
        verdict.broken.append(f"mode {mode}")
    flagged = is_flagged(record)
    away = measures.is_flagged(faults, fault_mask(*GONE)) | ~is_estimating(record)
    verdict.hold("back", _back(away, end), BACK)
    _judge_errors(record, truth, flagged, begin, verdict)
    return verdict


def is_estimating(record: Record) -> BoolArray:
    """At every sample: mode RUN, or FROZEN, where the state is estimated."""
    mode = record.health["mode"]
    estimating: BoolArray = (mode == lib.LEVER_MODE_RUN) | (mode == lib.LEVER_MODE_FROZEN)
    return estimating


def is_flagged(record: Record) -> BoolArray:
    """At every sample: a fault of DO_NOT_TRUST, a mode without estimates, or nothing at all."""
    health = record.health
    taken = np.diff(health["samples"].astype(np.int64), prepend=0) != 0
    since = np.arange(len(taken)) - np.maximum.accumulate(np.where(taken, np.arange(len(taken)), 0))
    warned = measures.is_flagged(health["faults"], DO_NOT_TRUST)
    flagged: BoolArray = warned | ~is_estimating(record) | (since >= UNHEARD)
    return flagged


def _not_finite(record: Record) -> int:
    columns = (record.estimate[name] for name in record.estimate.dtype.names or () if name != "time_us")
    return int(sum(np.count_nonzero(~np.isfinite(column)) for column in columns))


def _judge_torque(requirement: Requirement, record: Record, begin: int, end: int, verdict: Verdict) -> None:
    """By the limits of the gate as shipped."""
    from lever_cdkf.firmware.config import Config

    settings = Config().settings
    torque = record.asked
    step = 0.5e-3  # of the code in MOTOR_COMMAND
    verdict.hold("torque", float(np.abs(torque).max()), settings["torque_limit"] + step)
    window = round(1.0 / PERIOD)
    square = np.convolve(torque**2, np.full(window, 1.0 / window), "valid")
    verdict.hold("torque rms", math.sqrt(float(square.max())), settings["torque_rms"] + step)
    if requirement.torque_ends is not None:
        closed = torque[begin + round(requirement.torque_ends / PERIOD) : end]
        verdict.hold("torque left", float(np.abs(closed).max()), 0.0)


def _back(away: BoolArray, end: int) -> float:
    """Return seconds from the end of the fault until the firmware has been back for CALM."""
    after = away[end:]
    calm = round(CALM / PERIOD)
    if len(after) < calm:
        return 0.0  # the fault lasts to the end
    return float(measures.first_without(after, calm)) * PERIOD


def _judge_errors(
    record: Record, truth: Mapping[str, FloatArray], flagged: BoolArray, begin: int, verdict: Verdict
) -> None:
    """From the begin of the fault on."""
    first = begin // STRIDE
    shown = ~flagged[::STRIDE]
    shown[:first] = False
    silent, covered = dict.fromkeys(QUANTITIES, 0.0), 100.0
    for name in QUANTITIES:
        wrong = deviation(record, truth, name) > measures.WRONG
        silent[name] = measures.longest(wrong & shown) * PERIOD * STRIDE
        if shown.any():
            covered = min(covered, 100.0 * float(np.mean(~wrong[shown])))
    worst = max(silent, key=silent.__getitem__)
    verdict.hold("silent", silent[worst], SILENT)
    verdict.measured["covered"] = covered
    verdict.excerpt = _excerpt(record, truth, flagged, worst)
    last = round(AT_LAST / PERIOD / STRIDE)
    relative = (record.estimate["natural_frequency"] / truth["f_n"] - 1.0)[-last:]
    verdict.hold("error after", 100.0 * float(measures.rms(relative.astype(np.float64))), ERROR)


def _excerpt(
    record: Record, truth: Mapping[str, FloatArray], flagged: BoolArray, name: str, points: int = 400
) -> Excerpt:
    value, sigma = _stated(record, name)
    at = np.arange(0, len(value), max(1, len(value) // points))
    time = PERIOD * STRIDE * at.astype(np.float64)
    return Excerpt(name, time, truth[name][at], value[at], sigma[at], flagged[::STRIDE][at])


def deviation(record: Record, truth: Mapping[str, FloatArray], name: str) -> FloatArray:
    """Return size of the error in standard deviations that the firmware states."""
    value, sigma = _stated(record, name)
    with np.errstate(all="ignore"):
        size: FloatArray = np.abs(value - truth[name]) / sigma
    return size


def _stated(record: Record, name: str) -> tuple[FloatArray, FloatArray]:
    """Estimate and standard deviation of a quantity."""
    estimate = record.estimate
    if name in ("f_n", "zeta"):
        of = {"f_n": "natural_frequency", "zeta": "damping_ratio"}[name]
        return estimate[of], estimate[f"{of}_sigma"]
    i = QUANTITIES.index(name) - 2
    return estimate["parameter"][:, i], estimate["parameter_sigma"][:, i]
