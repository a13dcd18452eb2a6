"""What must hold of evidence, verdict and parameters, by firmware/REQUIREMENTS.md and firmware/app/README.md alone.

Each rule takes a flight and returns sentences that say when, and against which requirement, the estimator went. Times
in them are seconds since the event began.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from lever_cdkf.firmware.estimator import fault_names
from numpy.typing import NDArray

from blind.flights import RATE, READ, Flight
from blind.tables import (
    ALIGN,
    ALIGNED,
    APART,
    BASE,
    BLOCK,
    BOUND,
    CALIBRATION,
    CAUTION,
    CHANGE_WALK,
    CONFIRMED,
    EXCITATION,
    FAULT,
    FIRST,
    FROZEN,
    GREATEST,
    HANDS_OFF,
    INDEX,
    INNOVATION,
    JUMPED,
    LEAST,
    MISMATCH,
    PRIOR,
    RANK,
    RECOVERED,
    RESTED,
    RUN,
    SETTLING,
    SPIKE,
    STATISTICS,
    TAKEN_BACK,
    THETA,
    THETA_DOT,
    TORQUE,
    VERDICTS,
    WALK,
)


@cache
def evidence(flight: Flight) -> NDArray[np.bool_]:
    """Return which statistics are evidence at each reading: from above 1 until below `off`."""
    ratios = flight.ratios
    present = np.zeros(ratios.shape, bool)
    off = np.array([statistic.off for statistic in STATISTICS], np.float32)
    now = np.zeros(len(off), bool)
    above = ratios > 1.0
    some = np.asarray(above.any(axis=1))
    for row, ratio in enumerate(ratios):
        if some[row] or now.any():
            now = above[row] | (now & (ratio >= off))
            present[row] = now
    return present


def fault_words(faults: int) -> str:
    return " or ".join(name.upper() for name in fault_names(faults))


def sentence(flight: Flight, sample: int, requirement: str, what: str) -> str:
    event, mode, time = flight.event.name, flight.mode, (sample - flight.begin) / RATE
    return f"{event} in {mode.state}, torque {mode.torque}, at {time:+.3f} s, {requirement}: {what}"


def input_faults(flight: Flight, sample: int) -> int:
    """Return the faults that the inputs of a sample show by themselves (R31)."""
    faults = TORQUE if flight.mode.torque == "unmeasured" else 0
    event = flight.event
    if flight.begin <= sample < flight.end:
        if event.kind in ("missing", "implausible") and event.sensor is not None:
            faults |= (THETA, THETA_DOT, TORQUE, BASE)[event.sensor]
        if event.kind == "outputs":
            faults |= THETA | THETA_DOT
    return faults


def own_faults(flight: Flight, sample: int) -> int:
    """Return the faults that may show of a sensor that is wrong, besides its evidence: single values that are not
    plausible (R31, R34), after its jump back."""
    event = flight.event
    if event.gap and flight.end <= sample < flight.end + 2 * READ:
        return THETA | THETA_DOT | TORQUE | BASE  # frames may need to be found again, and inputs have jumped: R21, R31
    if event.clock_stands and flight.end <= sample < flight.end + SPIKE:
        return TORQUE | BASE
    if event.sensor is None or not flight.begin <= sample < flight.end + (JUMPED if event.sensor < 2 else SPIKE):
        return 0
    return (THETA | THETA_DOT, THETA | THETA_DOT, TORQUE, BASE)[event.sensor]


def _watched(flight: Flight) -> range:
    """Return the readings of the flight that belong to its event: the warm-up is the same for all events of a mode."""
    return range(int(np.searchsorted(flight.sample[flight.read], flight.begin)), len(flight.read))


# --- evidence, and what it shows as ----------------------------------------------------------------------------------


def shows(flight: Flight) -> list[str]:
    """Require that evidence shows as its faults in every mode, and as present in TEST_RATIO (R55, app/README)."""
    said, present = [], evidence(flight)
    some = np.asarray(present.any(axis=1))
    for row in _watched(flight):
        sample, faults = int(flight.sample[flight.read[row]]), int(flight.faults[flight.read[row]])
        statistic = int(flight.evidence[row])
        if statistic < len(STATISTICS) and statistic not in APART and flight.present[row] != present[row, statistic]:
            name, ratio = STATISTICS[statistic].name, flight.ratios[row, statistic]
            said.append(
                sentence(flight, sample, "app/README", f"TEST_RATIO of {name} {ratio:.3f} says {flight.present[row]}")
            )
        must = 0
        for index in np.flatnonzero(present[row]) if some[row] else ():
            if index not in APART:
                must |= STATISTICS[index].shows
        ignored = flight.event.clock_stands and flight.begin <= sample < flight.end + BLOCK
        if must & ~faults and not ignored:
            names = [STATISTICS[index].name for index in np.flatnonzero(present[row])]
            said.append(
                sentence(flight, sample, "R55", f"evidence {names}, but {fault_words(must & ~faults)} does not show")
            )
        may = must | BASE | input_faults(flight, sample) | own_faults(flight, sample)
        only = THETA | THETA_DOT | TORQUE | BASE | INNOVATION | MISMATCH | CALIBRATION | HANDS_OFF
        extra = faults & only & ~may
        if extra:
            said.append(sentence(flight, sample, "R55", f"{fault_words(extra)} shows without evidence"))
    return said


def shows_base(flight: Flight) -> list[str]:
    """Require that BASE shows while its test ratio says that the response to the base is wrong (R55, app/README)."""
    said, index = [], INDEX["base"]
    faults = flight.faults[flight.read]
    for row in _watched(flight):
        sample, ratio = int(flight.sample[flight.read[row]]), flight.ratios[row, index]
        other = evidence(flight)[row, INDEX["base_stuck"]] or flight.event.sensor == 3 or flight.event.gap
        if evidence(flight)[row, index] and not faults[row] & BASE:
            said.append(sentence(flight, sample, "R55", f"ratio of base {ratio:.3f}, but BASE does not show"))
        if not evidence(flight)[row, index] and faults[row] & BASE and not other:
            said.append(sentence(flight, sample, "R55", f"BASE shows, but the ratio of base is {ratio:.3f}"))
    return said


@cache
def _recent(flight: Flight) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return the faults that were there in all, and in any, of the samples of a block and a reading up to each
    reading."""
    back_ = np.arange(BLOCK + READ + 1)
    window = flight.faults[np.maximum(flight.read[:, None] - back_, 0)]
    return np.bitwise_and.reduce(window, axis=1), np.bitwise_or.reduce(window, axis=1)


def stands(flight: Flight) -> list[str]:
    """Require that the verdict is the first of the table whose evidence is present, in every mode (R55, app/README)."""
    said, present = [], evidence(flight)
    samples, modes = flight.sample[flight.read], flight.modes[flight.read]
    always, ever = _recent(flight)
    outputs = flight.faults & (THETA | THETA_DOT)
    stood = flight.event.clock_stands & (samples >= flight.begin) & (samples < flight.end + BLOCK)
    changed = held = -10 * RATE  # samples of the last change and of the last new hold
    watched = _watched(flight)
    learns = np.array([verdict.learn for verdict in VERDICTS] + [False] * (16 - len(VERDICTS)))
    learnt = int(READ * (learns[flight.verdict[: watched.start]] & (modes[: watched.start] == RUN)).sum())
    known, first_guess = learnt, _first_guess(flight)
    before = np.flatnonzero(present[: watched.start, INDEX["change"]])
    changed = int(samples[before[-1]]) if len(before) else changed
    for row in watched:
        sample, verdict = int(samples[row]), int(flight.verdict[row])
        changed = sample if present[row, INDEX["change"]] else changed
        must = {STATISTICS[index].name for index in np.flatnonzero(present[row]) if index not in APART}
        may = set(must)
        own = flight.event.sensor == 3 and flight.begin <= sample < flight.end + SPIKE
        states = [("unsettled", SETTLING), ("rest", EXCITATION), ("base", BASE)]
        for name, fault in states[: 2 if own else 3]:
            must |= {name} if always[row] & fault else set()
            may |= {name} if ever[row] & fault else set()
        no_arm = BOUND | MISMATCH
        must |= {"unexplained"} if always[row] & no_arm == no_arm else set()
        may |= {"unexplained"} if ever[row] & no_arm == no_arm else set()
        at = int(flight.read[row])
        may |= {"missing"} if np.any((outputs[max(0, at - BLOCK - READ) : at + 1]) == THETA | THETA_DOT) else set()
        may |= {"base"} if own else set()
        blind = _blind(flight, sample)
        must |= {"missing"} if blind == 2 else set()
        may |= {"missing"} if blind else set()
        opened = verdict == RANK["unexplained"]
        if present[row, INDEX["hands"]] or opened:
            held = sample  # guess: a new hold counts as a change
        if present[row, INDEX["hands"]] or present[row, INDEX["sticking"]] or opened or first_guess[row]:
            known = -(10**6)  # guess: what was opened is new; how long, no text says
        if min(sample - changed, sample - held) <= CONFIRMED + 3 * BLOCK:
            may.add("regrip")
        if min(sample - changed, sample - held) <= CAUTION + CONFIRMED + 2 * BLOCK or known <= CAUTION + 3 * BLOCK:
            may.add("new")
        if learnt < CAUTION - 2 * BLOCK and FROZEN not in modes[max(0, row - 2) : row + 1]:
            must.add("new")
        first = next(rank for rank, row_ in enumerate(VERDICTS) if not row_.because or set(row_.because) & must)
        allowed = [rank for rank, row_ in enumerate(VERDICTS[:first]) if set(row_.because) & may]
        if verdict < len(VERDICTS) and verdict not in (first, *allowed) and modes[row] != ALIGN and not stood[row]:
            due = VERDICTS[first].name
            said.append(
                sentence(
                    flight, sample, "app/README", f"verdict {VERDICTS[verdict].name}, not {due}, by {sorted(must)}"
                )
            )
        if learns[verdict] and modes[row] == RUN:
            learnt, known = learnt + READ, known + READ
    return said


def rests(flight: Flight) -> list[str]:
    """Require that a rest, once shown, lasts 0.3 s: it ends that long after there was too little motion last
    (app/README)."""
    if flight.event.clock_stands:  # samples that are ignored show nothing else
        return []
    shown = np.concatenate(([False], (flight.faults & EXCITATION) != 0, [False]))
    edges = np.flatnonzero(shown[1:] != shown[:-1]).reshape(-1, 2)
    return [
        sentence(flight, int(begin), "app/README", f"a rest of {end - begin} samples")
        for begin, end in edges
        if end < len(flight.faults) and end - begin < RESTED - 2 * BLOCK
    ]


def _blind(flight: Flight, sample: int) -> int:
    """Return 2 where neither output, no base acceleration or a torque that is not known has come for a block, 1 where
    one of these has been so within the last block, else 0."""
    event, foreign = flight.event, flight.mode.torque == "foreign"
    gone = event.kind in ("missing", "implausible")
    if event.gap:  # no block ends while levels are aligned anew
        return int(flight.begin <= sample < flight.end + ALIGNED + 2 * BLOCK)
    if event.sensor == 3 and event.kind in ("stuck", "zero"):  # a stuck base is held as a missing one is
        return int(flight.begin <= sample < flight.end + 2 * BLOCK)
    if not (event.kind == "outputs" or (gone and event.sensor == 3) or (gone and event.sensor == 2 and foreign)):
        return 0
    if flight.begin + 2 * BLOCK <= sample < flight.end:
        return 2
    return int(flight.begin <= sample < flight.end + 2 * BLOCK)


# --- parameters ------------------------------------------------------------------------------------------------------


def _entered(flight: Flight, row: int) -> str:
    """Return what is done on entering the verdict of a reading, if it was another one before."""
    now, before = int(flight.verdict[row]), int(flight.verdict[row - 1])
    return VERDICTS[now].entry if now != before and now < len(VERDICTS) else ""


def _left(flight: Flight, row: int) -> str:
    """Return what is done on leaving the verdict before a reading, if it is another one now."""
    now, before = int(flight.verdict[row]), int(flight.verdict[row - 1])
    return VERDICTS[before].exit if now != before and before < len(VERDICTS) else ""


def _moves(flight: Flight) -> NDArray[np.int64]:
    """Return the readings of the event at which the parameters are others than at the one before."""
    values, start = flight.estimate["parameter"], _watched(flight).start
    return np.flatnonzero((values[start:] != values[start - 1 : -1]).any(axis=1)) + start


def holds(flight: Flight) -> list[str]:
    """Require that parameters change only where the verdict lets them learn, and not in FROZEN (R5, R55)."""
    said = []
    values, samples = flight.estimate["parameter"], flight.sample[flight.read]
    for row in _moves(flight):
        if int(flight.verdict[row]) >= len(VERDICTS):
            continue
        sample, mode, now = int(samples[row]), int(flight.modes[flight.read[row]]), VERDICTS[int(flight.verdict[row])]
        entry = _entered(flight, row)
        if now.learn and mode != FROZEN and entry != "restore":
            continue
        moved = f"parameters went from {values[row - 1]} to {values[row]}"
        if entry == "restore":
            # R55: what was taught within the last two seconds, and since the fault began, is taken back.
            latest = max(flight.begin + BLOCK, sample - TAKEN_BACK)
            older = values[:row][samples[:row] <= latest]
            if not np.isclose(older, values[row], rtol=1e-6).all(axis=1).any():
                said.append(sentence(flight, sample, "R55", f"{moved}, which they were at no time up to then"))
        elif mode == FROZEN:
            said.append(sentence(flight, sample, "R55", f"{moved} in FROZEN, verdict {now.name}"))
        elif not now.learn and entry != "inflate":  # a block that shows a change has learnt (app/README)
            said.append(sentence(flight, sample, "R5", f"{moved}, although verdict {now.name} does not permit it"))
    return said


@cache
def _first_guess(flight: Flight) -> NDArray[np.bool_]:
    """Return at which readings the parameters are those of the first guess."""
    return np.asarray(np.isclose(flight.estimate["parameter"], FIRST, rtol=1e-6).all(axis=1))


def keeps(flight: Flight) -> list[str]:
    """Require that parameters go back to the first guess only where something is taken back, or the filter is restarted
    and that is reported (R13, app/README: no verdict but those with `restore` has such an action, once an arm is
    known)."""
    said: list[str] = []
    if flight.mode.state == "settling":
        return said
    for row in _moves(flight):
        fault = int(flight.faults[flight.read[row]])
        if _first_guess(flight)[row] and _entered(flight, row) != "restore" and not fault & RECOVERED:
            verdict, sample = (
                VERDICTS[min(int(flight.verdict[row]), len(VERDICTS) - 1)],
                int(flight.sample[flight.read[row]]),
            )
            said.append(sentence(flight, sample, "R13", f"back to the first guess, verdict {verdict.name}"))
    return said


def adapts(flight: Flight) -> list[str]:
    """Require that whiteness and calibration are judged in verdict learning only (app/README, adapt)."""
    said = []
    for name in ("colour", "calibration"):
        ratios = flight.ratios[:, INDEX[name]]
        for row in _watched(flight):
            verdicts = flight.verdict[row - 1 : row + 1]
            known = (verdicts < len(VERDICTS)).all()
            if known and (verdicts != RANK["learning"]).all() and ratios[row] > ratios[row - 1] + 1e-3:
                what = f"ratio of {name} goes from {ratios[row - 1]:.3f} to {ratios[row]:.3f}"
                at = int(flight.sample[flight.read[row]])
                said.append(sentence(flight, at, "app/README", f"{what}, verdict {VERDICTS[verdicts[1]].name}"))
    return said


def certain(flight: Flight) -> list[str]:
    """Require that standard deviations do not shrink where nothing is learnt, nor grow in FROZEN (R5, R55)."""
    said = []
    spread, samples = flight.estimate["parameter_sigma"], flight.sample[flight.read]
    for row in _watched(flight):
        verdict, mode = int(flight.verdict[row]), int(flight.modes[flight.read[row]])
        sample, ratio = int(samples[row]), spread[row] / spread[row - 1]
        if verdict >= len(VERDICTS) or flight.modes[flight.read[row - 1]] != mode or mode == ALIGN:
            continue
        action = _entered(flight, row) or _left(flight, row)
        kept = action not in ("restore", "inflate")  # for inflate see opens()
        if (
            (mode == FROZEN or not VERDICTS[verdict].learn) and kept and (ratio < 0.99).any()
        ):  # the tolerances that it contains may vary
            said.append(sentence(flight, sample, "R5", f"standard deviations shrink by {ratio}, nothing is learnt"))
        if mode == FROZEN and not action and (ratio > 1.001).any():
            said.append(sentence(flight, sample, "R55", f"standard deviations grow by {ratio} in FROZEN"))
    return said


def opens(flight: Flight) -> list[str]:
    """Require that parameters are as uncertain as at the start after a lever that nobody held, and where friction holds
    it (R60, app/README), and have walked for change_walk at once at a change."""
    said = []
    relative = flight.estimate["parameter_sigma"] / flight.estimate["parameter"]
    for row in _watched(flight):
        now, before = int(flight.verdict[row]), int(flight.verdict[row - 1])
        if now == before or max(now, before) >= len(VERDICTS):
            continue
        sample = int(flight.sample[flight.read[row]])
        if "open" in (VERDICTS[now].entry, VERDICTS[before].exit) and (relative[row] < 0.99 * PRIOR).any():
            said.append(sentence(flight, sample, "R60", f"opened, but standard deviations are {relative[row]} of it"))
        if VERDICTS[now].entry == "inflate":
            due = np.minimum(np.sqrt(relative[row - 1] ** 2 + WALK**2 * CHANGE_WALK), PRIOR)
            # A tenth for what the block has taught before.
            if (relative[row] < 0.9 * due).any():
                said.append(sentence(flight, sample, "R6", f"standard deviations are {relative[row]}, not {due}"))
    return said


def finite(flight: Flight) -> list[str]:
    """Require finite estimates within their bounds, and a filter neither restarted nor in fault (R9, R12, R13)."""
    values = flight.estimate["parameter"]
    said = [
        sentence(flight, flight.begin, "R12", f"{name} is not finite")
        for name in flight.estimate.dtype.names or ()
        if not np.isfinite(flight.estimate[name]).all()
    ]
    if (values < 0.99999 * LEAST).any() or (values > 1.00001 * GREATEST).any():
        said.append(sentence(flight, flight.begin, "R9", f"parameters from {values.min(0)} to {values.max(0)}"))
    rests = ((values <= 1.000001 * LEAST) | (values >= 0.999999 * GREATEST)).any(axis=1)  # of float's rounding
    silent = np.flatnonzero(rests & ((flight.faults[flight.read] & BOUND) == 0))
    if len(silent):
        at = int(flight.sample[flight.read[silent[0]]])
        said.append(
            sentence(flight, at, "R9", f"{values[silent[0]]} rests on a bound in {len(silent)} readings without BOUND")
        )
    if (flight.modes == FAULT).any() or flight.recoveries or (flight.faults & RECOVERED).any():
        said.append(sentence(flight, flight.begin, "R13", f"restarted {flight.recoveries} times"))
    return said
