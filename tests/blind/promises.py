"""What must hold of torque, reports and the time after an event: rules as in oracle.py, of what is seen outside."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blind.flights import AFTER_GAP, DITHER, RATE, READ, Event, Flight, Mode
from blind.flights import flight as flight_of
from blind.oracle import evidence, fault_words, input_faults, own_faults, sentence
from blind.tables import (
    ALIGN,
    AT_REST,
    BASE,
    BLOCK,
    CHANGE,
    CLOCK,
    EXCITATION,
    FADED_IN,
    FAULT,
    FROZEN,
    GAP,
    GATE,
    GRIPPED,
    HANDS_OFF,
    INDEX,
    INIT,
    LAST_OUTPUT,
    MANY,
    MISMATCH,
    MOTOR,
    NOBODY,
    NOT_FITTING,
    NOT_THE_INTEGRAL,
    REPORTED,
    RUN,
    SETTLED,
    SETTLING,
    SPIKE,
    STUCK,
    THETA,
    THETA_DOT,
    TORQUE,
    TORQUE_LIMIT,
    TORQUE_SLEW,
    UNCHANGED,
    VERDICTS,
)

# --- torque ----------------------------------------------------------------------------------------------------------


def _forbids(flight: Flight) -> tuple[NDArray[np.int64], dict[str, NDArray[np.bool_]]]:
    """Return the samples from the event on, and what forbids torque in each (R37, app/README, the façade)."""
    watch = np.flatnonzero(flight.sample >= flight.begin)
    rows = np.searchsorted(flight.read, watch, side="right") - 1
    closing = [INDEX[name] for verdict in VERDICTS if not verdict.torque for name in verdict.because]
    never = np.asarray(evidence(flight)[rows][:, closing].any(1))
    if never.any():  # until a COMMAND asks for torque anew, after one that did not: never in these flights
        never[int(never.argmax()) :] = True
    during = (flight.sample[watch] > flight.begin) & (flight.sample[watch] < flight.end)
    stood = during & np.bool_(flight.event.clock_stands)
    mode = np.isin(flight.modes[watch], (INIT, ALIGN, FAULT))
    believed = (flight.faults[watch] & (THETA | THETA_DOT)) != THETA | THETA_DOT
    since = np.arange(len(watch)) - np.maximum.accumulate(np.where(believed, np.arange(len(watch)), 0))
    return watch, {"verdict": never, "clock": stood, "mode": mode, "outputs": since >= LAST_OUTPUT}


def drives(flight: Flight) -> list[str]:
    """Require that torque is out only where verdict, mode, outputs and clock permit it (R36, R37, app/README)."""
    said, torque = [], np.abs(flight.torque)
    if flight.mode.torque != "dither":
        if torque.any():
            said.append(sentence(flight, int(flight.sample[torque.argmax()]), "R37", "torque that nobody asked for"))
        return said
    worst = int(torque.argmax())
    if torque[worst] > TORQUE_LIMIT:
        said.append(sentence(flight, int(flight.sample[worst]), "R36", f"{torque[worst]:.3f} N m"))
    rise = np.where(np.diff(flight.sample) == 1, np.diff(torque), 0.0)
    if rise.max() > 1.001 * TORQUE_SLEW / RATE:
        said.append(sentence(flight, int(flight.sample[rise.argmax() + 1]), "R36", f"{rise.max():.3f} N m in a sample"))
    watch, causes = _forbids(flight)
    forbidden = np.logical_or.reduce(list(causes.values()))
    held = np.convolve(forbidden, np.ones(GATE + 1, int))[: len(forbidden)] == GATE + 1
    late = np.flatnonzero(held & (torque[watch] > 0.0))
    if len(late):
        at, value = int(flight.sample[watch[late[0]]]), torque[watch[late[0]]]
        why = [name for name, cause in causes.items() if cause[late[0]]]
        said.append(sentence(flight, at, "R37", f"{value:.3f} N m, although {why} has forbidden it for {GATE} ms"))
    open_ = np.convolve(~forbidden, np.ones(FADED_IN, int))[: len(forbidden)] == FADED_IN
    last = watch[-RATE:]
    if flight.event.gap == 0 and open_[-1]:
        rms = float(np.sqrt(np.mean(flight.torque[last].astype(float) ** 2)))
        if not 0.5 * DITHER <= rms <= 1.5 * DITHER:  # a second of a band from 1 Hz on varies
            said.append(sentence(flight, int(flight.sample[last[0]]), "R41", f"dither of {rms:.3f} N m rms"))
    return said


def permits(flight: Flight) -> list[str]:
    """Require that a dither that was asked for is out wherever nothing forbids it (R41, app/README, torque)."""
    watch, causes = _forbids(flight)
    forbidden = np.logical_or.reduce(list(causes.values()))
    silent = (flight.torque[watch] == 0.0) & ~forbidden
    long = np.convolve(silent, np.ones(GATE, int))[: len(silent)] == GATE
    if not long.any():
        return []
    at = int(flight.sample[watch[long.argmax()]])
    verdict = int(flight.verdict[np.searchsorted(flight.read, watch[long.argmax()])])
    name = VERDICTS[verdict].name if verdict < len(VERDICTS) else "unknown"
    return [sentence(flight, at, "R41", f"no torque for {silent.sum()} ms, verdict {name}, which permits it")]


# --- promises of an event --------------------------------------------------------------------------------------------


class Promise(NamedTuple):
    """A fault that must show within some samples after the event began."""

    faults: int
    """Any of these."""
    within: int
    requirement: str


def promised(event: Event, mode: Mode) -> Promise | None:
    """Return what must be reported of an event; None where no requirement has anything, or nobody can tell."""
    if event.sensor is not None:
        return _promised_of_a_sensor(event.sensor, event.kind, mode.torque)
    if event.kind == "outputs":
        return Promise(THETA, 1, "R31")
    if event.clock_stands:
        return Promise(CLOCK, 2, "R30")
    if event.name == "hands_off":
        return Promise(HANDS_OFF, NOBODY, "R7")
    if event.name == "stiffer" and mode.state in ("run", "after_gap"):
        # R55 does not name changes among what FROZEN finds, and before anything was learnt no change can be known.
        return Promise(CHANGE, GRIPPED, "R6")
    if event.rest and mode.torque != "dither":  # which moves the lever
        return Promise(EXCITATION, AT_REST, "R56")
    return None


def _promised_of_a_sensor(sensor: int, kind: str, torque: str) -> Promise | None:
    own = (THETA, THETA_DOT, TORQUE, BASE)[sensor]
    if kind == "implausible" or (kind == "missing" and (sensor, torque) != (2, "unmeasured")):
        return Promise(own, 1, "R31")
    if sensor == 2 and torque != "dither":
        return None  # no reading, or no commanded torque that it would have to be like: no evidence of the table
    if kind == "spike":
        return Promise(own, 1, "R31") if sensor > 1 else None  # of an output R34 asks for no report
    if kind == "offset":
        return Promise(own, 1, "R33")
    if kind in ("stuck", "zero"):
        return Promise(own, MOTOR if sensor == 2 else STUCK, "R32")
    if sensor < 2 and kind in ("scaled", "sign", "very_late"):
        return Promise(THETA | THETA_DOT, NOT_THE_INTEGRAL, "R33")
    if sensor == 2 and kind in ("scaled", "sign", "very_late"):
        return Promise(TORQUE, MOTOR, "R55")
    return Promise(BASE, NOT_FITTING, "R33") if sensor == 3 and kind == "sign" else None


def reports(flight: Flight) -> list[str]:
    """Require that a fault is reported in time, and a missing value in each of its samples (R6, R7, R29 to R33)."""
    said, event = [], flight.event
    promise = promised(event, flight.mode)
    if event.gap:
        first = int(np.searchsorted(flight.sample, flight.end))
        if not flight.faults[first] & GAP:
            said.append(sentence(flight, flight.end, "R29", "the sample after a gap does not have GAP"))
    if promise is not None:
        during = (flight.sample >= flight.begin) & (flight.sample < flight.end)
        shown = (flight.faults[during] & promise.faults) != 0
        since = int(shown.argmax()) + 1 if shown.any() else len(shown)
        if not shown.any() or since > promise.within:
            when = f"after {since} ms" if shown.any() else "never"
            what = f"{fault_words(promise.faults)} shows {when}, not within {promise.within} ms"
            said.append(sentence(flight, flight.begin, promise.requirement, what))
        if promise.requirement == "R31" and not shown.all():
            said.append(
                sentence(
                    flight, flight.begin, "R31", f"{fault_words(promise.faults)} is not in {(~shown).sum()} samples"
                )
            )
    return said


def settles(flight: Flight) -> list[str]:
    """Require that levels settle for the whole of their time after an outage, and parameters are kept (R29)."""
    event = flight.event
    said: list[str] = []
    if not (event.gap or event.kind == "outputs"):
        return said
    resumed = flight.end + 2 * READ  # a frame may be lost meanwhile: R21
    after = (flight.sample >= resumed) & (flight.sample < flight.end + SETTLED - BLOCK)
    aligning = flight.modes[after] == ALIGN
    aligning[1:] |= aligning[:-1]  # see settles_at_once()
    missing = np.flatnonzero(((flight.faults[after] & SETTLING) == 0) & ~aligning)
    if len(missing):
        at = int(flight.sample[after][missing[0]])
        said.append(sentence(flight, at, "R29", f"levels have settled for {at - flight.end} ms only"))
    first = int(np.searchsorted(flight.sample, flight.end))
    long = event.gap > RATE // 2  # gap_limit
    if event.gap and (flight.modes[first] == ALIGN) != long and flight.mode.state in ("run", "frozen"):
        said.append(sentence(flight, flight.end, "R29", f"mode {flight.modes[first]} after a gap of {event.gap} ms"))
    if event.gap and flight.mode.state != "settling":
        samples = flight.sample[flight.read]
        before, later = (
            int(np.searchsorted(samples, flight.begin)) - 1,
            int(np.searchsorted(samples, flight.end + READ)),
        )
        spread = flight.estimate["parameter_sigma"]
        if not np.array_equal(flight.estimate["parameter"][before], flight.estimate["parameter"][later]):
            said.append(sentence(flight, flight.end, "R29", "parameters are others after the gap"))
        if long and not (spread[later] > spread[before]).all():
            said.append(
                sentence(flight, flight.end, "R29", f"not widened: {spread[before]} before, {spread[later]} after")
            )
    return said


def settles_at_once(flight: Flight) -> list[str]:
    """Require that SETTLING shows in each sample of mode RUN or FROZEN until the levels have settled (R29, R57)."""
    if not flight.event.gap:
        return []
    after = np.flatnonzero((flight.sample >= flight.end + 1) & (flight.sample < flight.end + SETTLED - BLOCK))
    silent = after[((flight.faults[after] & SETTLING) == 0) & np.isin(flight.modes[after], (RUN, FROZEN))]
    if not len(silent):
        return []
    return [sentence(flight, int(flight.sample[silent[0]]), "R29", f"{len(silent)} samples have no SETTLING")]


def jumps(flight: Flight) -> list[str]:
    """Require that an angle with another offset is reported for 20 ms, and while the parameters are held, and that
    nothing is learnt from its jump (R33)."""
    if flight.event.kind != "offset":
        return []
    said = []
    frozen = flight.mode.state == "frozen"
    ago = flight.sample - flight.begin
    lasts = flight.end - flight.begin if frozen else SPIKE - 1  # guess: 20 ms are 19 samples or 20
    must = (ago >= 0) & (ago < lasts)
    never = (ago >= 0) & (flight.sample < flight.end) & ~must & (ago >= SPIKE + BLOCK)
    shown = (flight.faults & THETA) != 0
    if (must & ~shown).any():
        at = int(flight.sample[(must & ~shown).argmax()])
        said.append(sentence(flight, at, "R33", f"{(must & ~shown).sum()} of {must.sum()} samples do not have THETA"))
    if (never & shown).any():
        at = int(flight.sample[(never & shown).argmax()])
        said.append(sentence(flight, at, "R33", f"THETA shows in {(never & shown).sum()} samples after its 20 ms"))
    without = flight_of("nothing", flight.mode)
    row = int(np.searchsorted(flight.sample[flight.read], flight.end)) - 1
    error = flight.estimate["parameter"][row] - without.estimate["parameter"][row]
    error = error / without.estimate["parameter_sigma"][row]
    if flight.mode.state == "run" and (np.abs(error) > 1.0).any():
        said.append(sentence(flight, flight.end, "R33", f"parameters are {error} sigma from those without a jump"))
    return said


def spikes(flight: Flight) -> list[str]:
    """Require that a single outlier changes no estimate, of an output (R34) or of an input, which is held (R31)."""
    said = []
    without = flight_of("nothing", flight.mode)
    row = int(np.searchsorted(flight.sample[flight.read], flight.begin + RATE)) - 1
    names = ["theta", "theta_dot"] if flight.mode.torque != "dither" else []  # another dither moves another way
    names += ["parameter"] if flight.mode.state != "after_gap" else []  # truthful() fails of the flight without it
    for name in names:
        error = (
            np.abs(flight.estimate[name][row] - without.estimate[name][row]) / without.estimate[f"{name}_sigma"][row]
        )
        if np.max(error) > UNCHANGED:
            said.append(sentence(flight, flight.begin + RATE, "R34", f"{name} is {error} sigma from that without it"))
    mode = np.isin(flight.modes[flight.sample >= flight.begin], (ALIGN, INIT, FAULT))
    if mode.any():
        said.append(sentence(flight, flight.begin, "R34", f"{mode.sum()} samples are aligned anew"))
    return said


def ignores(flight: Flight) -> list[str]:
    """Require that while the sample clock stands it is reported, and its samples are ignored (R30)."""
    if not flight.event.clock_stands:
        return []
    said, samples = [], flight.sample[flight.read]
    during = (flight.sample > flight.begin) & (flight.sample < flight.end)
    silent = int(((flight.faults[during] & CLOCK) == 0).sum())
    if silent:
        said.append(sentence(flight, flight.begin, "R30", f"{silent} samples of a clock that stands have no CLOCK"))
    rows = (samples > flight.begin + 1) & (samples < flight.end)
    for name in ("theta", "theta_dot", "parameter", "time_us"):
        values = flight.estimate[name][rows]
        if (values != values[0]).any():
            said.append(sentence(flight, flight.begin, "R30", f"{name} changes while the sample clock stands"))
    return said


def changed(flight: Flight) -> list[str]:
    """Require that a change is reported for three seconds and followed, and what is none is not reported (R6)."""
    said, shown = [], (flight.faults & CHANGE) != 0
    since = int(np.searchsorted(flight.sample, flight.begin))
    if flight.event.name == "nothing" and shown.any():
        first = int(flight.sample[shown.argmax()])
        said.append(sentence(flight, first, "R6", "CHANGE shows, although the pilot is the same all the time"))
    if flight.event.name == "stiffer" and flight.mode.state != "frozen" and shown[since:].any():
        starts = np.flatnonzero(shown[since + 1 :] & ~shown[since:-1]) + since + 1
        ends = np.flatnonzero(~shown[since + 1 :] & shown[since:-1]) + since + 1
        for start in starts:
            end = min([int(end) for end in ends if end > start], default=len(shown))
            if end < len(shown) and end - start < REPORTED - BLOCK:
                said.append(
                    sentence(flight, int(flight.sample[start]), "R6", f"CHANGE shows for {end - start} ms only")
                )
    if flight.event.name == "stiffer" and flight.mode.state == "run":
        truth, known = natural_frequency(1.4), float(flight.estimate["natural_frequency"][-1])
        if abs(known / truth - 1.0) > 0.05:  # README: f_n to 5 % in at most 2.7 s (`sudden_grip`); 7 s have passed
            said.append(sentence(flight, int(flight.sample[-1]), "R6", f"{known:.2f} Hz where {truth:.2f} Hz is true"))
    return said


def natural_frequency(stiffer: float) -> float:
    """Return that of the typical arm with its stiffness times a factor, about the trim [Hz]: DESIGN section 3."""
    total = 0.45**2 * (0.25 * 1.2 + 2.5) + 0.020
    stiffness = (0.45 * np.cos(np.radians(20.0))) ** 2 * 1500.0 * stiffer + 5.0
    return float(np.sqrt(stiffness / total) / (2.0 * np.pi))


RIGHT = ("nothing", "gap_50ms", "gap_1s", "clock_stands", "freeze", "run", "rest")  # events without a fault of a sensor


def back(flight: Flight) -> list[str]:
    """Require that the estimator is back by itself 2 s after an event (R35; `lever faults --help` has the time)."""
    said, mode = [], FROZEN if flight.mode.state == "frozen" else RUN
    last = slice(-RATE // 2, None)
    if (flight.modes[last] != mode).any():
        said.append(sentence(flight, int(flight.sample[-1]), "R35", f"mode {flight.modes[-1]}, not {mode}"))
    # INNOVATION, MISMATCH and CALIBRATION are averages: no text says how long they last.
    faults = int(np.bitwise_or.reduce(flight.faults[last])) & (THETA | THETA_DOT | TORQUE | BASE | CLOCK | HANDS_OFF)
    if faults & ~input_faults(flight, int(flight.sample[-1])):
        said.append(sentence(flight, int(flight.sample[-1]), "R35", f"{fault_words(faults)} two seconds after its end"))
    return said


def truthful(flight: Flight) -> list[str]:
    """Require that no fault shows of a sensor that is right, a motor that obeys and a hand that holds (R8, R55; enum
    lever_fault of lever_cdkf.h says what each means)."""
    said: list[str] = []
    only = THETA | THETA_DOT | TORQUE | BASE | MISMATCH | HANDS_OFF
    for at in np.flatnonzero((flight.faults & only) != 0):
        sample = int(flight.sample[at])
        # After the gap of the mode a frame may be lost, too.
        own = flight.mode.state == "after_gap" and -AFTER_GAP <= sample - flight.begin < 2 * READ - AFTER_GAP
        may = input_faults(flight, sample) | (THETA | THETA_DOT | TORQUE | BASE if own else 0)
        wrong = int(flight.faults[at]) & only & ~(may | own_faults(flight, sample))
        if wrong and len(said) < MANY:
            said.append(sentence(flight, sample, "R55", f"{fault_words(wrong)} shows, although nothing is wrong"))
    return said


def learns(flight: Flight) -> list[str]:
    """Require that something is learnt again after a fault, and that the mode is as commanded (R35, R55)."""
    said = []
    if flight.event.request != "none":
        during = (flight.sample >= flight.begin) & (flight.sample < flight.end)
        due = FROZEN if flight.event.request == "freeze" else RUN
        if (flight.modes[during] != due).any():
            said.append(sentence(flight, flight.begin, "R55", f"mode {set(flight.modes[during].tolist())}, not {due}"))
    still = flight.estimate["parameter"][-RATE // READ :]
    moves = bool((still != still[0]).any())
    if flight.mode.state != "frozen" and not moves:
        said.append(sentence(flight, int(flight.sample[-1]), "R35", "nothing is learnt in the last second"))
    if flight.mode.state == "frozen" and moves:
        said.append(sentence(flight, int(flight.sample[-1]), "R55", "parameters change in FROZEN"))
    return said
