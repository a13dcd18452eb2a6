"""A mapping proposed from what a log has: by names, words of the database, units, and what the values look like.

Each signal gets a score for each input; the best are taken, no signal twice. Names and units say most. Values decide
between signals that are called alike: an acceleration that rests at 1 g is the vertical one, an angle belongs to the
rate that is its slope, a lever moves with its base, and what stands still or counts is none.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import FloatArray
from ..numeric.derivative import STEP, derivative_correlation, derivative_ratio, interval_means
from ..text.units import GRAVITY
from .mapping import Mapping, Source
from .recorded import Signal
from .units import INPUTS, factor, fitting, is_unit, likely

_UNIT_FITS, _NO_UNIT, _UNIT_DOES_NOT = 4.0, 2.0, -8.0
_UNIT_OF_TORQUE = 7.0
"""There are many angles, but few torques: with this unit an odd name is enough, and words can only speak against."""
_GREATEST_TORQUE = 100.0
"""[N m] that a hand can hold against."""
_SAME_MESSAGE = 2.0
"""For what comes with the angle of the lever."""
_CLEAR = 1.0
"""By how much a torque has to be better than the next."""
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
_NEARLY = 3.0
"""A signal that lacks no more than this is named, for a person to decide."""


def _weights(text: str) -> dict[str, float]:
    """{"angle": 2.0, …} of "2: angle ang, -4: rate"."""
    groups = (group.split(":") for group in text.split(","))
    return {word: float(weight) for weight, words in groups for word in words.split()}


_WORDS = {
    "theta": _weights(
        "4: theta, 2: angle angular winkel, 1.5: position posn pos deflection displacement travel stellung auslenkung "
        "debattement, 1: rot ag, -4: rate vel velocity speed omega gyro acceleration accel vitesse geschwindigkeit "
        "drehrate drehzahl beschleunigung, -5: dot"
    ),
    "theta_dot": _weights(
        "3: rate velocity omega dot drehrate geschwindigkeit vitesse, 2: speed gyro, 1: angular theta, "
        "-3: acceleration accel beschleunigung"
    ),
    "z_ddot": _weights(
        "4: nz az zdd, 3: acceleration acc accel ddot beschleunigung, 2.5: z vertical vertikal verticale heave, "
        "2: down up gamma, 1.5: normal, 1: load base floor cabin cockpit seat boden sitz kabine plancher siege cabine, "
        "-3: x y long lat lateral longitudinal, -4: ax ay nx ny, -2: angular rot rotor engine"
    ),
    "tau_m": _weights(
        "3: torque tq tau drehmoment couple, 2: moment motor moteur, 1.5: actuator antrieb verin servo, "
        "-4: engine rotor mast gearbox mgb tail triebwerk getriebe, -1: shaft"
    ),
    "grip_force": _weights("3: force kraft effort grip poignee griff, 2: hand handle, 1: pilot"),
}
"""English, German and French words of names, and how much they speak for an input or against it."""
_LEVER_WORDS = _weights(
    "3: collective kollektiv collectif, 2.5: inceptor incptr, 2: lever hebel levier manche, 1.5: col, 1: stick grip, "
    "-1: pitch seat raw att, -2: roll steering elevation, -3: cyclic yaw azimuth rotor wheel engine nick gier, "
    "-4: pedal heading"
)
"""The same for all inputs that are the lever's."""
_NOT_MEASURED = _weights(
    "2: feedback fbk fb measured, 0: val value sig signal, -2: command cmd target ref setpoint demand soll consigne, "
    "-3: max min limit err error temp, -6: counter cnt crc checksum status valid state estimate sigma"
)
"""The same for all."""
_PARTS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+")
_COMPOUND = 5
"""Letters from which on a word is recognised inside another: the parts of Motormoment, Hebelwinkel."""
_CONSONANTS = re.compile(r"[^aeiou]{3,}")


@dataclass(frozen=True)
class Candidate:
    """A signal for an input, and why."""

    key: str
    signal: Signal
    score: float
    why: tuple[str, ...]


def propose(signals: Sequence[Signal], where: str) -> tuple[Mapping, list[Candidate], list[Candidate]]:
    """Return the mapping, the candidates that it is made of, and those that nearly are in it.

    Raise LeverError where there is none for lever or base.
    """
    moving = [signal for signal in signals if _moves(signal.values) and signal.period < 0.5]
    candidates = [_candidate(key, signal) for signal in moving for key in INPUTS]
    candidates = _with_movement(_with_slopes([each for each in candidates if each.score > _HOPELESS]))
    chosen: dict[str, Candidate] = {}
    nearly: list[Candidate] = []
    for key in INPUTS:
        taken = {each.signal.name for each in chosen.values()}
        if "theta" in chosen:
            candidates = _with_company(candidates, chosen["theta"].signal, key)
        best = [each for each in _best(candidates, key) if each.signal.name not in taken and _goes_with(each, chosen)]
        if best and best[0].score >= _LEAST[key] and _is_clear(key, best):
            chosen[key] = best[0]
        elif best and best[0].score >= _LEAST[key] - _NEARLY:
            nearly.append(best[0])
    if "z_ddot" not in chosen or not chosen.keys() & {"theta", "theta_dot"}:
        lacking = "an acceleration of the base" if chosen.keys() & {"theta", "theta_dot"} else "the angle of a lever"
        raise LeverError(
            f"{where}: no signal looks like {lacking}: map it by hand, with `lever replay --map KEY=SIGNAL`"
        )
    proposed = [chosen[key] for key in INPUTS if key in chosen]
    units = {each.key: _unit(each, chosen) for each in proposed}
    sources = {each.key: _source(each, chosen, units[each.key][0]) for each in proposed}
    return Mapping(sources), [replace(each, why=each.why + units[each.key][1]) for each in proposed], nearly


def _goes_with(each: Candidate, chosen: dict[str, Candidate]) -> bool:
    """Return whether a rate is the slope of the angle, perhaps with the other sign; another rate is worse than none."""
    if each.key != "theta_dot" or "theta" not in chosen:
        return True
    return abs(derivative_correlation(chosen["theta"].signal, each.signal)) > 0.5


def _is_clear(key: str, best: Sequence[Candidate]) -> bool:
    """Return whether no other torque may be meant as well."""
    return key != "tau_m" or len(best) == 1 or best[0].score - best[1].score >= _CLEAR


def _source(each: Candidate, chosen: dict[str, Candidate], unit: str) -> Source:
    turned = each.key == "theta_dot" and "theta" in chosen
    turned = turned and derivative_correlation(chosen["theta"].signal, each.signal) < 0.0
    return Source(each.signal.name, unit, sign=-1 if turned else None)


def _unit(each: Candidate, chosen: dict[str, Candidate]) -> tuple[str, tuple[str, ...]]:
    """Return the unit of a signal, or where it has none the likely one, and why it is that."""
    if each.signal.unit:
        return each.signal.unit, ()
    if each.key == "z_ddot":
        unit, why = likely(each.key, each.signal.values)
        return unit, (why,)
    if each.key == "theta_dot" and "theta" in chosen:
        angle = chosen["theta"].signal
        scale = factor("theta", angle.unit or likely("theta", angle.values)[0])
        ratio = abs(derivative_ratio(angle, each.signal))
        for unit in ("rad/s", "deg/s"):
            one = factor(each.key, unit)
            if scale and one and 0.5 < ratio * one / scale < 2.0:
                return unit, (f"{ratio:.2g} times the slope of {angle.name} as it stands",)
    unit, why = likely(each.key, each.signal.values)
    return unit, (why,)


def words_of(name: str) -> set[str]:
    """Return the words of a name: lever, angle, deg of LeverAngle_deg; without accents."""
    plain = "".join(letter for letter in unicodedata.normalize("NFKD", name) if not unicodedata.combining(letter))
    return {part.lower() for part in _PARTS.findall(plain)}


def _candidate(key: str, signal: Signal) -> Candidate:
    tables = [_WORDS[key], _NOT_MEASURED, *([] if key == "z_ddot" else [_LEVER_WORDS])]
    message, _, name = signal.name.rpartition(".")
    own = words_of(name)
    around = words_of(message) - own
    prose = words_of(signal.words) - own - around
    score = _by_unit(key, signal)
    says_itself = key == "tau_m" and score == _UNIT_OF_TORQUE
    for table in tables:
        weights = [_weight(table, word) for word in own] + [_ELSEWHERE * _weight(table, word) for word in around]
        weights += [_ELSEWHERE * table.get(word, 0.0) for word in prose]
        score += sum(min(weight, 0.0) if says_itself and table is tables[0] else weight for weight in weights)
    speaking = sorted(word for word in own if _weight(tables[0], word) > 0.0)
    why = [f"named {' '.join(speaking)}"] if speaking else []
    if key in fitting(signal.unit):
        why.append(f"in {signal.unit}")
    if key == "z_ddot" and (level := _gravity(signal.values)):
        score += _HAS_GRAVITY
        why.append(f"rests at {level:.3g}, which is gravity")
    return Candidate(key, signal, score, tuple(why))


def _by_unit(key: str, signal: Signal) -> float:
    scale = factor(key, signal.unit)
    if scale is None:
        return _NO_UNIT if not signal.unit else _UNIT_DOES_NOT * (is_unit(signal.unit) or signal.unit == "%")
    if key != "tau_m":
        return _UNIT_FITS
    return _UNIT_OF_TORQUE if scale * np.nanmax(np.abs(signal.values)) < _GREATEST_TORQUE else _UNIT_DOES_NOT


def _weight(weights: dict[str, float], word: str) -> float:
    """Return the weight of a word of a name: as it is, made of several, or shortened (lvr, trq, pos)."""
    if word in weights:
        return weights[word]
    inside = [known for known in weights if len(known) >= _COMPOUND and known in word]
    if inside:
        parts = [known for known in inside if not any(known in other and known != other for other in inside)]
        return sum(weights[known] for known in parts)
    full = [known for known in weights if _shortens(word, known)]
    return weights[min(full, key=len)] if full else 0.0


def _shortens(word: str, known: str) -> bool:
    """Return whether a word is the beginning of another, or some of its consonants in their order."""
    if len(word) < 3 or len(known) < _COMPOUND or word[0] != known[0]:
        return False
    letters = iter(known)
    return known.startswith(word) or (_CONSONANTS.fullmatch(word) is not None and all(each in letters for each in word))


# --- what values look like -------------------------------------------------------------------------------------------


def _moves(values: FloatArray) -> bool:
    """Return whether it is measured: not constant, and no counter."""
    present = values[np.isfinite(values)]
    if len(present) < 20 or not np.ptp(present) > 0.0:
        return False
    return not np.mean(np.diff(present[:2000]) == 1.0) > 0.8


def _gravity(values: FloatArray) -> float:
    """Return the level of a signal that holds gravity, in g or m/s²; 0 where it does not."""
    present = values[np.isfinite(values)]
    level, spread = float(np.median(present)), float(np.std(present))
    near = any(abs(abs(level) - gravity) < 0.15 * gravity and spread < gravity for gravity in (1.0, GRAVITY))
    return level if near else 0.0


def _best(candidates: Iterable[Candidate], key: str) -> list[Candidate]:
    of_key = [each for each in candidates if each.key == key]
    return sorted(of_key, key=lambda each: -each.score)[:_COMPARED]


def _with_slopes(candidates: list[Candidate]) -> list[Candidate]:
    """Return the candidates, where angles and rates that belong together have gained."""
    gains: dict[tuple[str, str], tuple[float, str]] = {}
    for angle in _best(candidates, "theta"):
        for rate in _best(candidates, "theta_dot"):
            if angle.signal.name != rate.signal.name and derivative_correlation(angle.signal, rate.signal) > 0.8:
                gains["theta", angle.signal.name] = _IS_SLOPE, f"its slope is {rate.signal.name}"
                gains["theta_dot", rate.signal.name] = _IS_SLOPE, f"the slope of {angle.signal.name}"
    return _gained(candidates, gains)


def _with_movement(candidates: list[Candidate]) -> list[Candidate]:
    """Return the candidates, where what moves with the base has gained: it shakes both the lever and the arm on it."""
    base = _best(candidates, "z_ddot")[:1]
    gains: dict[tuple[str, str], tuple[float, str]] = {}
    for key in ("theta", "theta_dot"):
        for each in _best(candidates, key):
            if base and each.signal.name != base[0].signal.name:
                share = _coherence(base[0].signal, each.signal)
                words = f"moves with {base[0].signal.name} (coherence {share:.2f})" if share > 0.3 else ""
                gains[key, each.signal.name] = _MOVES_WITH_BASE * share, words
    return _gained(candidates, gains)


def _with_company(candidates: list[Candidate], angle: Signal, key: str) -> list[Candidate]:
    """Return the candidates, where what is in the angle's own message has gained."""
    message, _, _ = angle.name.rpartition(".")
    beside = [each for each in candidates if each.key == key and message and each.signal.name.startswith(f"{message}.")]
    words = f"in the message of {angle.name}"
    return _gained(candidates, {(key, each.signal.name): (_SAME_MESSAGE, words) for each in beside})


def _gained(candidates: list[Candidate], gains: dict[tuple[str, str], tuple[float, str]]) -> list[Candidate]:
    gained = []
    for each in candidates:
        gain, words = gains.get((each.key, each.signal.name), (0.0, ""))
        gained.append(replace(each, score=each.score + gain, why=(*each.why, words) if words else each.why))
    return gained


def _coherence(base: Signal, lever: Signal) -> float:
    """Return mean coherence of two signals from 2 to 8 Hz, less what chance gives."""
    both = interval_means(base, lever)
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
