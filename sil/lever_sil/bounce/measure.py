"""What is measured in a flight: each function flies what it needs with one aircraft and one pilot."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from lever_cdkf.firmware.library import lib
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from .. import measures
from ..acceptance.result import Figure, largest, least, mean
from ..aircraft.stability import critical_gearing
from ..fast import plants
from ..plants.truth import Conditions
from . import detectors, pilots
from .detectors import Watched
from .flights import STRIDE, Flown, Plan, fly, truth_of

Figures = dict[str, float]

BEYOND = 1.1
"""Gearing of the flights in which a pilot relaxes, over that which is critical in the end."""
STABLE = 0.5
"""Gearing of the flights that are stable, over the least that is critical in them: a gain margin of 6 dB, which
MIL-F-9490 asks of a flight control system."""
LOUD = 2.0
"""Vibration over that which counts as usual, or over that of the same flight without the lever in the loop."""
SWUNG = math.radians(10.0)
"""Beyond that the lever is in a limit cycle."""


@dataclass(frozen=True)
class Excerpt:
    """A flight for a chart: columns at some hundred times."""

    time: FloatArray
    """[s]"""
    true: FloatArray
    """Gain margin [dB]."""
    margin: FloatArray
    sigma: FloatArray
    theta: FloatArray
    """About its trim [deg]."""
    z_ddot: FloatArray
    """[m/s^2]"""
    correction: FloatArray
    """[deg]"""
    moments: Mapping[str, float] = field(default_factory=dict)
    """What happened when [s]."""


@dataclass(frozen=True)
class Measured:
    """Of one aircraft and pilot."""

    figures: Figures
    excerpt: Excerpt | None = None


def excerpt(flown: Flown, points: int = 500) -> Excerpt:
    """Return the part of a flight that a reader gets to see."""
    every = max(1, len(flown.notes) // points)
    said, step = flown.stability[::every], every * STRIDE
    return Excerpt(
        flown.notes[::every],
        flown.margins(every),
        said["gain_margin"].astype(np.float64),
        said["gain_margin_sigma"].astype(np.float64),
        np.degrees(flown.theta - flown.theta[0])[::step],
        flown.z_ddot[::step],
        np.degrees(flown.correction)[::step],
    )


def _least_critical(plan: Plan) -> float:
    """Return the least gearing that is critical at any time of a flight [1]."""
    truth = truth_of(plan)
    at = np.arange(0, len(truth.rest), 1000 // STRIDE)
    unmitigated = replace(plan, low_pass=0.0).aircraft
    return float(critical_gearing(unmitigated, truth.transfer(at)).min())


def geared(plan: Plan, ratio: float) -> Plan:
    """With so many times the gearing that is critical when it is least."""
    return replace(plan, gearing=ratio * _least_critical(plan))


# --- margin and alarm ------------------------------------------------------------------------------------------------


def _loudness(flown: Flown) -> FloatArray:
    """Return the rms of z_ddot over the last second, at the notes."""
    square = np.cumsum(np.append(0.0, flown.z_ddot**2))
    at = np.arange(0, len(flown.time), STRIDE) + 1
    begin = np.maximum(at - 1000, 0)
    loudness: FloatArray = np.sqrt((square[at] - square[begin]) / (at - begin))
    return loudness


def _doubled(flown: Flown) -> float:
    """Return from when on the vibration is LOUD times what it was in the first ten seconds [s].

    It is that for two seconds at least: a single gust does not count. The end of the flight: never.
    """
    loudness, notes = _loudness(flown), flown.notes
    steady = float(np.median(loudness[(notes > 2.0) & (notes < 10.0)]))
    lasts = round(2.0 / (notes[1] - notes[0]))
    windows = np.lib.stride_tricks.sliding_window_view(loudness > LOUD * steady, lasts)
    loud: BoolArray = np.logical_and.reduce(windows, axis=1)
    return min(_first(loud & (notes[: len(loud)] > 10.0), notes), float(notes[-1]))


def _first(where: BoolArray, time: FloatArray) -> float:
    """Return the first of these times [s]; inf: never."""
    return float(time[int(np.argmax(where))]) if where.any() else math.inf


def standing(alarmed: BoolArray, time: FloatArray, until: float) -> float:
    """When the alarm was raised that stands at `until`, or else the next one [s]; one that has ended does not count."""
    begun = time[np.diff(alarmed, prepend=False) & alarmed]
    at = int(np.searchsorted(time, until, side="right")) - 1
    return float(begun[begun <= until][-1]) if alarmed[at] else _first(alarmed & (time > until), time)


Spoil = Callable[[Plan], Plan]


def _as_it_is(plan: Plan) -> Plan:
    return plan


def relaxing(craft: str, seed: int, *, spoil: Spoil = _as_it_is) -> Measured:
    """Fly a pilot who relaxes until the loop is unstable, and tell who sees it coming."""
    flown = fly(geared(spoil(Plan(craft, seed, pilots.relaxing(seed), 1.0, duration=75.0)), BEYOND))
    notes, doubled = flown.notes, _doubled(flown)
    alarm = standing(flown.stability["state"] == lib.LEVER_BOUNCE_ALARM, notes, doubled)
    rover, spectrum = (_first(level > limit, time) for time, level, limit in _detected(flown))
    at = int(np.searchsorted(notes, alarm)) if math.isfinite(alarm) else 0
    figures = {
        "alarm lead": doubled - min(alarm, float(notes[-1])),
        "missed": float(math.isinf(alarm)),
        "ROVER lead": doubled - rover,
        "spectrum lead": doubled - spectrum,
        "ahead of ROVER": min(rover, float(notes[-1])) - alarm,
        "ahead of spectrum": min(spectrum, float(notes[-1])) - alarm,
        "margin at the alarm": float(flown.margins(10)[at // 10]) if math.isfinite(alarm) else math.nan,
    }
    moments = {"alarm": alarm, "vibration doubled": doubled if doubled < notes[-1] else math.inf}
    known = {name: moment for name, moment in moments.items() if math.isfinite(moment)}
    return Measured(figures | _margins(flown), replace(excerpt(flown), moments=known))


def _detected(flown: Flown) -> Sequence[tuple[FloatArray, FloatArray, float]]:
    """Return time [s], level and threshold of each of the baselines."""
    coupled = flown.plan.scenario.aircraft
    assert coupled is not None
    watched = Watched.of(flown.theta, flown.z_ddot, flown.plan.scenario.period)
    rover = detectors.rover(watched, lambda s: complex(coupled.response(np.array([s]))[0]))
    spectrum = detectors.spectrum(watched)
    time = (np.arange(len(spectrum)) + 1.0) / detectors.RATE
    limits = detectors.THRESHOLDS[flown.plan.craft]
    return (time, rover, limits[0]), (time, spectrum, limits[1])


def _margins(flown: Flown) -> Figures:
    """Return how right the stated gain margin is.

    It counts where one is stated and the lever does not swing by more than SWUNG.
    """
    every = 25
    said, true = flown.stability[::every], flown.margins(every)
    angle = np.abs(flown.theta - flown.truth.rest)
    swing = np.maximum.accumulate(angle)[:: STRIDE * every]
    judged = (flown.notes[::every] > 5.0) & (swing < SWUNG) & (true < 20.0)
    stated = judged & (said["state"] != lib.LEVER_BOUNCE_UNKNOWN)
    error = said["gain_margin"] - true
    near = stated & (np.abs(true) < 6.0)
    return {
        "margin covered": 100.0 * float(measures.covered(error[stated], said["gain_margin_sigma"][stated])),
        "margin rms": float(measures.rms(error[near])) if near.any() else math.nan,
        "margin stated": 100.0 * float(np.sum(stated) / max(1, np.sum(judged))),
    }


def stable(craft: str, seed: int, *, duration: float, ratio: float = STABLE, spoil: Spoil = _as_it_is) -> Measured:
    """Fly a restless pilot in a loop that stays stable, and tell who raises an alarm."""
    flown = fly(geared(spoil(Plan(craft, seed, pilots.restless(seed, duration), 1.0, duration=duration)), ratio))
    alarmed = flown.stability["state"] == lib.LEVER_BOUNCE_ALARM
    (_, rover, rover_limit), (_, spectrum, spectrum_limit) = _detected(flown)
    figures = {
        "false alarms": float(np.count_nonzero(np.diff(alarmed, prepend=False) & alarmed)),
        "flight time": duration / 3600.0,
        "ROVER level": float(rover.max()),
        "spectrum level": float(spectrum.max()),
        "ROVER false alarms": float(rover.max() > rover_limit),
        "spectrum false alarms": float(spectrum.max() > spectrum_limit),
    }
    return Measured(figures | _margins(flown), excerpt(flown))


# --- mitigation ------------------------------------------------------------------------------------------------------

_JUDGED = (40.0, 60.0)
"""When vibration is [s]."""
_LEAST, _COARSE, _FINE, _MOST = 0.5, 1.5, 2, 9.0
_SOUGHT_TO = 8.54  # seven coarse steps up


def _slack(craft: str, seed: int, mitigation: str, **changes: Any) -> Plan:
    plan = Plan(craft, seed, pilots.table(pilots.arm(seed, pilots.SLACK)), 1.0, mitigation=mitigation)
    return replace(plan, **changes)


def raised(plan: Plan, ratio: float, critical: float | None = None) -> Plan:
    """Return a stable flight in which the gearing goes up to so many times the critical one, which may be known."""
    critical = critical or _least_critical(plan)
    return replace(plan, gearing=ratio * critical, raised_from=min(ratio, STABLE) * critical)


def _vibration(flown: Flown) -> float:
    """Return the rms of z_ddot [m/s^2]."""
    return float(np.sqrt(np.mean(flown.z_ddot[flown.during(*_JUDGED)] ** 2)))


def _uncoupled(plan: Plan) -> float:
    """Return the vibration by the same gusts while nobody's lever turns the blades."""
    return _vibration(fly(replace(plan, gearing=1e-9, raised_from=None, mitigation="none", dither=0.0)))


def largest_gearing(craft: str, seed: int, *, mitigation: str, spoil: Spoil = _as_it_is, **changes: Any) -> Measured:
    """Return up to which gearing the vibration stays below LOUD times that without the lever.

    It goes in steps of a factor, finer about the first at which the vibration does not.
    """
    plan = spoil(_slack(craft, seed, mitigation, **changes))
    return Measured({"gearing ÷ critical": _largest_quiet(plan, LOUD * _uncoupled(plan))})


def _largest_quiet(plan: Plan, most: float) -> float:
    critical = _least_critical(plan)

    def is_quiet(ratio: float) -> bool:
        return _vibration(fly(raised(plan, ratio, critical))) <= most

    quiet, factor = _LEAST, _COARSE
    while quiet * factor <= _MOST and is_quiet(quiet * factor):
        quiet *= factor
    for _ in range(_FINE):
        factor = math.sqrt(factor)
        if quiet * factor <= _MOST and is_quiet(quiet * factor):
            quiet *= factor
    return quiet


_GRIPPED = 45.0
"""When the pilot tightens his grip [s]."""
CANCELLED_AT = 2.0
"""Gearing over the critical one."""


def cancelled(craft: str, seed: int, *, mitigation: str, **changes: Any) -> Measured:
    """Return how much of what the cabin does to the lever is left in its corrected angle."""
    flown = fly(raised(_slack(craft, seed, mitigation, **changes), CANCELLED_AT))
    involuntary, residual = _involuntary(flown)
    window = flown.during(30.0, 60.0)
    factor = 1.4 if seed % 2 else 1.0 / 1.4
    plan = _slack(craft, seed, mitigation, pilot=pilots.gripping(seed, _GRIPPED, factor), **changes)
    after = fly(raised(plan, CANCELLED_AT))
    return Measured(
        {
            "involuntary cancelled": 100.0 * (1.0 - _share(residual[window], involuntary[window])),
            "back after a grip": _back(after),
        },
        excerpt(after),
    )


def _involuntary(flown: Flown) -> tuple[FloatArray, FloatArray]:
    """Return what cabin and motor alone make of the lever's angle [rad], and what the correction leaves of that.

    Both are from 2 to 8 Hz.
    """
    period = flown.plan.scenario.period
    quiet = Conditions(flown.z_ddot, period, 0.0, 0.0, np.random.default_rng(0))
    theta, _, _ = plants.move(flown.truth, quiet, flown.tau_m)
    alone = theta - flown.truth.rest
    left = alone + (flown.corrected - flown.theta)
    return _in_band(alone, period), _in_band(left, period)


def _in_band(signal: FloatArray, period: float) -> FloatArray:
    spectrum, frequency = np.fft.rfft(signal), np.fft.rfftfreq(len(signal), period)
    spectrum[(frequency < 2.0) | (frequency > 8.0)] = 0.0
    passed: FloatArray = np.fft.irfft(spectrum, len(signal))
    return passed


def _share(part: FloatArray, whole: FloatArray) -> float:
    return float(np.sum(part**2) / np.sum(whole**2))


def _back(flown: Flown) -> float:
    """From the grip until 80 % of the power of two seconds is cancelled [s]."""
    involuntary, residual = _involuntary(flown)
    first, period = flown.during(_GRIPPED, 60.0).start, 1e-3
    for begin in range(first, first + 10_000, 50):
        window = slice(begin, begin + 2000)
        if _share(residual[window], involuntary[window]) <= 0.2:
            return float(begin - first) * period
    return math.inf


VOLUNTARY = 0.5
"""[Hz]"""


def voluntary(craft: str, seed: int, *, mitigation: str, ratio: float = STABLE, **changes: Any) -> Measured:
    """Return what the mitigation makes of the pilot's own flying: his trim to the corrected angle.

    It is that with it over without, at so many times the critical gearing. At 0 the cabin does not answer.
    """
    pilot = pilots.table(pilots.arm(seed, pilots.SLACK))
    moves = {"kind": "sinusoid", "mean": pilot["trim"], "amplitude": "2 deg", "frequency": f"{VOLUNTARY} Hz"}
    plan = geared(_slack(craft, seed, mitigation, pilot=pilot | {"trim": moves}, **changes), max(ratio, 1e-9))
    answer = _answer(fly(plan)) / _answer(fly(replace(plan, mitigation="none", low_pass=0.0)))
    return Measured(
        {
            "gain changed": 100.0 * abs(abs(answer) - 1.0),
            "phase changed": abs(math.degrees(math.atan2(answer.imag, answer.real))),
        }
    )


def _answer(flown: Flown) -> complex:
    """Return the answer of the corrected angle at VOLUNTARY, over twenty cycles [rad]."""
    window = flown.during(20.0, 60.0)
    turned = np.exp(-2j * math.pi * VOLUNTARY * flown.time[window])
    return complex(np.mean(flown.corrected[window] * turned))


# --- what is wrong ---------------------------------------------------------------------------------------------------

STABLE_WITHOUT = 0.7
"""Gearing over critical of the flights in which a wrong model must do no harm: 3 dB."""


def wrong(craft: str, seed: int, *, mitigations: Sequence[str], spoil: Callable[[Plan], Plan]) -> Measured:
    """Vibration with each mitigation over that without, in a loop that is stable without."""
    plan = geared(spoil(_slack(craft, seed, "none")), STABLE_WITHOUT)
    passive = fly(plan)
    flown = [fly(replace(plan, mitigation=each)) for each in mitigations]
    ratio = max(map(_vibration, flown)) / _vibration(passive)
    angle = max(map(_lever_in_band, flown)) / _lever_in_band(passive)
    return Measured({"vibration ÷ passive": ratio, "angle ÷ passive": angle, "destabilised": float(ratio > LOUD)})


def _lever_in_band(flown: Flown) -> float:
    """Return the rms of the corrected angle, 2 to 8 Hz [rad]."""
    period = flown.plan.scenario.period
    return float(np.std(_in_band(flown.corrected - flown.truth.rest, period)[flown.during(*_JUDGED)]))


FAULT = 40.0
"""When a sensor fails in mid-mitigation [s]."""
_NOTHING, _NO_TORQUE = math.radians(0.005), 2e-3


def faulty(craft: str, seed: int, *, mitigation: str, spoil: Callable[[Plan], Plan]) -> Measured:
    """Return how soon after a fault correction and torque are zero.

    With it is by how much the correction jumps in a sample.
    """
    plan = spoil(replace(_slack(craft, seed, mitigation), duration=FAULT + 2.0, dither=0.0))
    flown = fly(raised(plan, CANCELLED_AT))
    after = flown.during(FAULT, FAULT + 2.0)
    acts = (np.abs(flown.correction[after]) > _NOTHING) | (np.abs(flown.tau_m[after]) > _NO_TORQUE)
    jumps = np.abs(np.diff(flown.correction[flown.during(FAULT - 0.01, FAULT + 2.0)]))
    last = int(np.flatnonzero(acts)[-1]) + 1 if acts.any() else 0
    zero = math.inf if acts[-1] else last * plan.scenario.period
    return Measured({"to zero": zero, "jump": math.degrees(float(jumps.max()))}, excerpt(flown))


def harmful(craft: str, seed: int, *, mitigation: str, spoil: Spoil) -> Measured:
    """Return for how long after a fault the correction adds to the lever's motion.

    It does while the corrected angle is larger than the lever's, both from 2 to 8 Hz, as rms over a quarter of a
    second.
    """
    plan = spoil(replace(_slack(craft, seed, mitigation), duration=FAULT + 5.0, dither=0.0))
    flown, period = fly(raised(plan, CANCELLED_AT)), plan.scenario.period
    passed = [_in_band(angle - flown.truth.rest, period) ** 2 for angle in (flown.corrected, flown.theta)]
    width = round(0.25 / period)
    with_it, without = (np.convolve(square, np.full(width, 1.0 / width), "same") for square in passed)
    after = flown.during(FAULT, FAULT + 4.5)
    adds = np.flatnonzero((with_it > without)[after])
    jumps = np.abs(np.diff(flown.correction[flown.during(FAULT - 0.01, FAULT + 5.0)]))
    figures = {"adds for": float(len(adds)) * period, "jump": math.degrees(float(jumps.max()))}
    return Measured(figures, excerpt(flown))


# --- figures ---------------------------------------------------------------------------------------------------------


def _total(values: FloatArray) -> float:
    return float(np.sum(values))


def _rms(values: FloatArray) -> float:
    """Return the root mean square over the runs that have a value."""
    return float(measures.rms(values[~np.isnan(values)]))


FIGURES: Mapping[str, Figure] = {
    "alarm lead": Figure("s", f"alarm before the vibration is {LOUD:g} × usual for two seconds", least, False),
    "ROVER lead": Figure("s", "the same of the ROVER-like detector", least, False),
    "spectrum lead": Figure("s", "the same of the recursive Fourier transform", least, False),
    "ahead of ROVER": Figure("s", "alarm before that of the ROVER-like detector", least, False),
    "ahead of spectrum": Figure("s", "alarm before that of the recursive Fourier transform", least, False),
    "margin at the alarm": Figure("dB", "true gain margin when the alarm is raised", mean),
    "margin covered": Figure("%", "share of time with the true gain margin within ±2σ", mean, False),
    "margin rms": Figure("dB", "rms error of the gain margin within 6 dB of the limit", _rms),
    "margin stated": Figure("%", "share of time with a state other than UNKNOWN", mean, False),
    "false alarms": Figure("1", "alarms in stable flight", _total),
    "flight time": Figure("h", "simulated", _total),
    "ROVER level": Figure("m/s²", "greatest level of the ROVER-like detector", largest),
    "spectrum level": Figure("m/s²", "greatest level of the recursive Fourier transform", largest),
    "ROVER false alarms": Figure("1", "flights in which the ROVER-like detector raises an alarm", _total),
    "spectrum false alarms": Figure("1", "flights in which the recursive Fourier transform does", _total),
    "gearing ÷ critical": Figure(
        "1", f"largest with {LOUD:g} × the vibration without the lever at most", least, False, _SOUGHT_TO
    ),
    "involuntary cancelled": Figure("%", "of the power of θ by cabin and motor, 2 to 8 Hz", mean, False),
    "back after a grip": Figure("s", "until 80 % of two seconds are cancelled again", largest),
    "gain changed": Figure("%", f"of the pilot's input at {VOLUNTARY:g} Hz", largest),
    "phase changed": Figure("°", f"of the pilot's input at {VOLUNTARY:g} Hz", largest),
    "vibration ÷ passive": Figure("1", "of the cabin, greatest of the mitigations", largest),
    "angle ÷ passive": Figure("1", "corrected angle of the lever, 2 to 8 Hz, greatest of the mitigations", largest),
    "destabilised": Figure("1", f"runs with more than {LOUD:g} × the vibration without mitigation", _total),
    "missed": Figure("1", "flights in which no alarm came", _total),
    "adds for": Figure("s", "time after the fault for which the correction adds to the lever's motion", largest),
    "to zero": Figure("s", "from the fault until correction and torque are zero", largest),
    "jump": Figure("°", "greatest change of the correction from sample to sample after the fault", largest),
}
"""By name."""
