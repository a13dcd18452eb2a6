"""A mapping proposed from what a log has: by names, words of the database, units, and what the values look like.

Each signal gets a score for each input; the best are taken, no signal twice. Names and units say most. Values decide
between signals that are called alike: an acceleration that rests at 1 g is the vertical one, an angle belongs to the
rate that is its slope, a lever moves with its base, and what stands still or counts is none.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import FloatArray
from ..errors import LeverError
from ..units import GRAVITY
from .mapping import Mapping, Source
from .recorded import Signal
from .slope import STEP, slope_likeness, together
from .units import INPUTS, fitting, is_unit

_UNIT_FITS, _NO_UNIT, _UNIT_DOES_NOT = 4.0, 2.0, -8.0
_IS_SLOPE = 4.0
_MOVES_WITH_BASE = 4.0
"""Times the coherence with the acceleration, 0 to 1."""
_HOPELESS = -4.0
_SEGMENT = 128
"""Means in a segment of which a coherence is made."""
_COMPARED = 12
"""Signals of an input whose values are compared with others', the best by name and unit."""
_HAS_GRAVITY = 3.0
_ELSEWHERE = 0.5
"""Weight of words that are not in the signal's own name, but in its message's and in what the database says of it."""
_LEAST = {"theta": 2.0, "theta_dot": 2.5, "z_ddot": 3.0, "tau_m": 7.0, "grip_force": 7.0}
"""Score from which on a signal is proposed: a torque of something else is worse than none."""


def _weights(text: str) -> dict[str, float]:
    """{"angle": 2.0, …} of "2: angle ang, -4: rate"."""
    groups = (group.split(":") for group in text.split(","))
    return {word: float(weight) for weight, words in groups for word in words.split()}


_WORDS = {
    "theta": _weights(
        "4: theta, 2: angle ang winkel angular, 1.5: pos position deflection displacement travel, "
        "-4: rate vel velocity speed omega gyro acc accel acceleration, -5: dot"
    ),
    "theta_dot": _weights(
        "3: rate vel velocity omega dot, 2: speed gyro, 1: angular theta, -3: acc accel acceleration"
    ),
    "z_ddot": _weights(
        "4: nz az zdd, 3: acc accel acceleration ddot beschleunigung, 2.5: z vert vertical heave, 2: down up, "
        "1.5: normal, 1: load base floor cabin, -3: x y long lat lateral longitudinal, -4: ax ay nx ny, "
        "-2: angular rot rotor engine"
    ),
    "tau_m": _weights("3: torque trq tau, 2: moment mom motor mot, 1.5: actuator act, -4: engine rotor shaft"),
    "grip_force": _weights("3: force frc kraft grip, 2: hand handle, 1: pilot"),
}
"""Words in names, and how much they speak for an input or against it."""
_LEVER_WORDS = _weights(
    "3: collective coll, 2.5: inceptor incep, 2: lever lvr, 1: stick grip, "
    "-1: pitch seat raw att, -2: roll steering elevation trim, -3: cyclic cyc yaw azimuth rotor wheel engine, "
    "-4: pedal ped heading"
)
"""The same for all inputs that are the lever's."""
_NOT_MEASURED = _weights(
    "-2: cmd command target ref setpoint demand, -3: max min limit err error temp, "
    "-6: counter cnt crc checksum status valid state estimate sigma"
)
"""The same for all."""
_PARTS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")


@dataclass(frozen=True)
class Candidate:
    """A signal for an input, and why."""

    key: str
    signal: Signal
    score: float
    why: tuple[str, ...]


def propose(signals: Sequence[Signal], where: str) -> tuple[Mapping, list[Candidate]]:
    """The mapping, and the candidates that it is made of. Raises LeverError where there is none for lever or base."""
    moving = [signal for signal in signals if _moves(signal.values) and signal.period < 0.5]
    candidates = [_candidate(key, signal) for signal in moving for key in INPUTS]
    candidates = _with_movement(_with_slopes([each for each in candidates if each.score > _HOPELESS]))
    chosen: dict[str, Candidate] = {}
    for key in INPUTS:
        taken = {each.signal.name for each in chosen.values()}
        for each in _best(candidates, key):
            if each.score >= _LEAST[key] and each.signal.name not in taken and _goes_with(each, chosen):
                chosen[key] = each
                break
    if "z_ddot" not in chosen or not chosen.keys() & {"theta", "theta_dot"}:
        lacking = "an acceleration of the base" if chosen.keys() & {"theta", "theta_dot"} else "the angle of a lever"
        raise LeverError(f"{where}: no signal looks like {lacking}: map it by hand, with --map KEY=SIGNAL")
    proposed = [chosen[key] for key in INPUTS if key in chosen]
    return Mapping({each.key: _source(each, chosen) for each in proposed}), proposed


def _goes_with(each: Candidate, chosen: dict[str, Candidate]) -> bool:
    """Whether a rate is the slope of the angle, perhaps with the other sign; another rate is worse than none."""
    if each.key != "theta_dot" or "theta" not in chosen:
        return True
    return abs(slope_likeness(chosen["theta"].signal, each.signal)) > 0.5


def _source(each: Candidate, chosen: dict[str, Candidate]) -> Source:
    turned = each.key == "theta_dot" and "theta" in chosen
    turned = turned and slope_likeness(chosen["theta"].signal, each.signal) < 0.0
    return Source(each.signal.name, each.signal.unit, sign=-1 if turned else None)


def words_of(name: str) -> set[str]:
    """The words of a name: lever, angle, deg of LeverAngle_deg."""
    return {part.lower() for part in _PARTS.findall(name)}


def _candidate(key: str, signal: Signal) -> Candidate:
    tables = [_WORDS[key], _NOT_MEASURED, *([] if key == "z_ddot" else [_LEVER_WORDS])]
    message, _, name = signal.name.rpartition(".")
    own, elsewhere = words_of(name), words_of(f"{message} {signal.words}")
    score = sum(_sum(each, own) + _ELSEWHERE * _sum(each, elsewhere - own) for each in tables)
    speaking = sorted(word for word in own if _sum(tables[0], [word]) > 0.0)
    why = [f"named {' '.join(speaking)}"] if speaking else []
    if key in fitting(signal.unit):
        score += _UNIT_FITS
        why.append(f"in {signal.unit}")
    elif not signal.unit:
        score += _NO_UNIT
    elif is_unit(signal.unit) or signal.unit == "%":
        score += _UNIT_DOES_NOT
    if key == "z_ddot" and (level := _gravity(signal.values)):
        score += _HAS_GRAVITY
        why.append(f"rests at {level:.3g}, which is gravity")
    return Candidate(key, signal, score, tuple(why))


def _sum(weights: dict[str, float], words: Iterable[str]) -> float:
    return sum(weights.get(word, 0.0) for word in words)


# --- what values look like -------------------------------------------------------------------------------------------


def _moves(values: FloatArray) -> bool:
    """Whether it is measured: not constant, and no counter."""
    present = values[np.isfinite(values)]
    if len(present) < 20 or not np.ptp(present) > 0.0:
        return False
    return not np.mean(np.diff(present[:2000]) == 1.0) > 0.8


def _gravity(values: FloatArray) -> float:
    """The level of a signal that holds gravity, in g or m/s²; 0 where it does not."""
    present = values[np.isfinite(values)]
    level, spread = float(np.median(present)), float(np.std(present))
    near = any(abs(abs(level) - gravity) < 0.15 * gravity and spread < gravity for gravity in (1.0, GRAVITY))
    return level if near else 0.0


def _best(candidates: Iterable[Candidate], key: str) -> list[Candidate]:
    of_key = [each for each in candidates if each.key == key]
    return sorted(of_key, key=lambda each: -each.score)[:_COMPARED]


def _with_slopes(candidates: list[Candidate]) -> list[Candidate]:
    """Angles and rates that belong together gain."""
    gains: dict[tuple[str, str], tuple[float, str]] = {}
    for angle in _best(candidates, "theta"):
        for rate in _best(candidates, "theta_dot"):
            if angle.signal.name != rate.signal.name and slope_likeness(angle.signal, rate.signal) > 0.8:
                gains["theta", angle.signal.name] = _IS_SLOPE, f"its slope is {rate.signal.name}"
                gains["theta_dot", rate.signal.name] = _IS_SLOPE, f"the slope of {angle.signal.name}"
    return _gained(candidates, gains)


def _with_movement(candidates: list[Candidate]) -> list[Candidate]:
    """What moves with the base gains: the lever is held by an arm, the base shakes both."""
    base = _best(candidates, "z_ddot")[:1]
    gains: dict[tuple[str, str], tuple[float, str]] = {}
    for key in ("theta", "theta_dot"):
        for each in _best(candidates, key):
            if base and each.signal.name != base[0].signal.name:
                share = _coherence(base[0].signal, each.signal)
                words = f"moves with {base[0].signal.name} (coherence {share:.2f})" if share > 0.3 else ""
                gains[key, each.signal.name] = _MOVES_WITH_BASE * share, words
    return _gained(candidates, gains)


def _gained(candidates: list[Candidate], gains: dict[tuple[str, str], tuple[float, str]]) -> list[Candidate]:
    gained = []
    for each in candidates:
        gain, words = gains.get((each.key, each.signal.name), (0.0, ""))
        gained.append(replace(each, score=each.score + gain, why=(*each.why, words) if words else each.why))
    return gained


def _coherence(base: Signal, lever: Signal) -> float:
    """Mean coherence of two signals from 2 to 8 Hz, less what chance gives."""
    both = together(base, lever)
    if len(both[0]) < 8 * _SEGMENT or not all(np.isfinite(each).any() for each in both):
        return 0.0
    window = np.hanning(_SEGMENT)
    spectra = []
    for each in both:
        filled = np.where(np.isfinite(each), each, np.nanmean(each))
        pieces = np.lib.stride_tricks.sliding_window_view(np.diff(filled), _SEGMENT)[:: _SEGMENT // 2]
        spectra.append(np.fft.rfft(window * pieces, axis=1))
    cross = np.abs(np.mean(spectra[0].conj() * spectra[1], axis=0)) ** 2
    power = np.mean(np.abs(spectra[0]) ** 2, axis=0) * np.mean(np.abs(spectra[1]) ** 2, axis=0)
    frequency = np.fft.rfftfreq(_SEGMENT, STEP)
    band = (frequency >= 2.0) & (frequency <= 8.0) & (power > 0.0)
    chance = 2.0 / len(spectra[0])
    return max(float(np.mean(cross[band] / power[band])) - chance, 0.0) if band.any() else 0.0
