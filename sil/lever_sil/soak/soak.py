"""Flights one after another through one instance of the firmware, and what each hour of them came to."""

from __future__ import annotations

import os
import resource
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import DO_NOT_TRUST, Estimator
from lever_cdkf.firmware.library import lib
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from lever_cdkf.numeric.stretches import runs
from numpy.typing import NDArray

from .. import measures
from ..fast.closed_loop import STRIDE, Loop
from ..run.summary import judged_samples
from ..scenarios import inputs as scenario_inputs
from ..scenarios.scenario import Scenario
from .flights import AT_REST, DURATION, draw

PARAMETERS = ("m_p", "c_p", "k_p")
QUANTITIES = (*PARAMETERS, "natural_frequency", "damping_ratio")
HOUR = 3600.0
COUNTS = "silent [s]"
"""The first column that is a count, and no measure of consistency."""
GROWTH = 20.0
"""By so much memory may grow after the first flights, for all that Python keeps [MiB]."""
SETTLED = 4
"""Flights, after which it should have what it needs."""
WRONG = 1.0
"""An estimate that is wrong (measures.WRONG) without a flag for longer [s] is a silent error."""

Show = Callable[[int, int], None]


@dataclass
class Sums:
    """Of some flights."""

    seconds: float = 0.0
    looks: int = 0
    """At the estimates, one a STRIDE."""
    judged: int = 0
    """Of those, later than SETTLED after a start or grip,"""
    unflagged: int = 0
    """and without a flag; the following are of these."""
    nees: float = 0.0
    """Sum of e' P^-1 e / 3 of the parameters."""
    nis: float = 0.0
    """Sum of nis / nis_size."""
    within: dict[str, int] = field(default_factory=lambda: dict.fromkeys(QUANTITIES, 0))
    """Truth within 2 sigma."""
    silent_s: float = 0.0
    """In stretches of more than WRONG with some quantity beyond measures.WRONG."""
    not_finite: int = 0
    in_fault: int = 0
    """Looks in mode FAULT."""
    counts: Counter[str] = field(default_factory=Counter)
    """Of lever_health_t, and of the faults that there were."""

    def add(self, other: Sums) -> None:
        """Add the sums of other flights."""
        for name in ("seconds", "looks", "judged", "unflagged", "nees", "nis", "silent_s", "not_finite", "in_fault"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name, count in other.within.items():
            self.within[name] += count
        self.counts += other.counts

    def row(self) -> dict[str, Any]:
        """As printed and in JSON."""
        shown = max(self.unflagged, 1)
        return {
            "flights": round(self.seconds / DURATION),
            "flagged [%]": 100.0 * (1.0 - self.unflagged / max(self.judged, 1)),
            "NEES (expected 1)": self.nees / shown,
            "NIS (expected 1)": self.nis / shown,
            **{f"{name} within 2 sigma [%]": 100.0 * count / shown for name, count in self.within.items()},
            COUNTS: self.silent_s,
            **{name: self.counts[name] for name in ("lost", "late", "corrupt", "recoveries")},
        }


def memory() -> float:
    """Return the memory of this process, now [MiB]; where the system does not say, the most that it ever was."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10


@dataclass(frozen=True)
class Part:
    """An hour, or what there is of it."""

    sums: Sums
    memory: float
    """At its end [MiB]."""


@dataclass(frozen=True)
class SoakResult:
    """The results of a soak, hour by hour."""

    parts: list[Part]
    settled_memory: float
    """After the first flights [MiB]."""
    faults: Counter[str]
    """How many there were of each kind."""

    @property
    def total(self) -> Sums:
        """The sums over all hours."""
        total = Sums()
        for part in self.parts:
            total.add(part.sums)
        return total

    @property
    def growth(self) -> float:
        """Return by how much the memory has grown since it had settled [MiB]."""
        return self.parts[-1].memory - self.settled_memory

    def troubles(self) -> list[str]:
        """Return what must not be."""
        total = self.total
        found = []
        if total.not_finite:
            found.append(f"{total.not_finite} estimates were not finite")
        if total.in_fault:
            found.append(f"the estimator was in fault for {total.in_fault * STRIDE:g} s")
        if self.growth > GROWTH:
            found.append(f"memory grew by {self.growth:.0f} MiB")
        return found


def run(hours: float, seed: int, show: Show) -> SoakResult:
    """Fly for so many hours, in flights of DURATION."""
    estimator = Estimator(Config())
    count = max(1, round(hours * HOUR / DURATION))
    of_an_hour = round(HOUR / DURATION)
    parts, kinds = [], Counter[str]()
    sums, settled = Sums(), 0.0
    for number in range(count):
        scenario, faults = draw(seed, number)
        kinds.update(faults)
        sums.add(_fly(scenario, estimator, number))
        if number + 1 == min(SETTLED, count):
            settled = memory()
        if (number + 1) % of_an_hour == 0 or number + 1 == count:
            parts.append(Part(sums, memory()))
            sums = Sums()
        show(number + 1, count)
    return SoakResult(parts, settled, kinds)


def _fly(scenario: Scenario, estimator: Estimator, number: int) -> Sums:
    """Fly one flight; the instance goes on from the one before."""
    inputs = scenario_inputs.prepare(scenario)
    every = round(STRIDE / scenario.period)
    before = estimator.health()
    loop = Loop(scenario, inputs, by_frames=False, every=every, estimator=estimator)
    start_us = round(number * (DURATION + AT_REST) * 1e6)
    times = start_us + np.round(inputs.time * 1e6).astype(np.int64)
    loop.give_time((times & 0xFFFFFFFF).astype(np.uint32))
    loop.advance(len(inputs.time))
    loop.check()
    estimates, healths = loop.outputs
    after = estimator.health()
    sums = judge(scenario, inputs.time[::every], inputs.truth.at(slice(None, None, every)), estimates, healths)
    sums.seconds = DURATION
    sums.counts.update({name: getattr(after, name) - getattr(before, name) for name in _COUNTS})
    sums.counts["lost"] -= round(AT_REST / scenario.period) if number else 0
    return sums


_COUNTS = ("lost", "late", "corrupt", "recoveries")


def judge(scenario: Scenario, time: FloatArray, truth: Any, estimates: NDArray[Any], healths: NDArray[Any]) -> Sums:
    """Return the sums of one flight from its estimates and healths at `time` [s] and the truth there."""
    values = {**truth.parameters, **vars(truth.dynamics)}
    judged = judged_samples(scenario, time) & np.isfinite(values["natural_frequency"])
    running = (healths["mode"] == lib.LEVER_MODE_RUN) | (healths["mode"] == lib.LEVER_MODE_FROZEN)
    unflagged = judged & running & ~measures.is_flagged(healths["faults"], DO_NOT_TRUST)
    sums = Sums(looks=len(time), judged=int(judged.sum()), unflagged=int(unflagged.sum()))
    sums.in_fault = int(np.sum(healths["mode"] == lib.LEVER_MODE_FAULT))
    sums.not_finite = int(sum(np.sum(~np.isfinite(estimates[name])) for name in ("parameter", "parameter_sigma")))
    beyond = np.zeros(len(time), np.bool_)
    for name, error, sigma in _errors(values, estimates):
        size = np.abs(error) / sigma
        sums.within[name] = int(np.sum(size[unflagged] <= 2.0))
        beyond |= size > measures.WRONG
    sums.silent_s = _stretches(beyond & unflagged) * STRIDE
    sums.nees = float(np.sum(_nees(values, estimates)[unflagged]))
    sizes = estimates["nis_size"][unflagged]
    sums.nis = float(np.sum(estimates["nis"][unflagged] / np.maximum(sizes, 1)))
    return sums


def _errors(values: dict[str, FloatArray], estimates: NDArray[Any]) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    for index, name in enumerate(PARAMETERS):
        yield name, estimates["parameter"][:, index] - values[name], estimates["parameter_sigma"][:, index]
    for name in QUANTITIES[len(PARAMETERS) :]:
        yield name, estimates[name] - values[name], estimates[f"{name}_sigma"]


def _nees(values: dict[str, FloatArray], estimates: NDArray[Any]) -> FloatArray:
    """Return e' P^-1 e / 3 on the logarithmic scale of the filter; expected 1."""
    estimate = estimates["parameter"].astype(np.float64)
    with np.errstate(all="ignore"):
        error = np.log(estimate / np.stack([values[name] for name in PARAMETERS], axis=-1))
        scaled = error * estimate / estimates["parameter_sigma"]
    correlation = measures.covariance_of(np.ones_like(scaled), estimates["parameter_correlation"])
    usable = np.isfinite(scaled).all(axis=1) & (np.linalg.det(correlation) > 1e-9)
    nees = np.zeros(len(estimate))
    nees[usable] = measures.normalised_squares(scaled[usable], correlation[usable]) / 3.0
    return nees


def _stretches(wrong: BoolArray) -> int:
    """Look in stretches that last longer than WRONG."""
    lengths = (last - first + 1 for first, last in runs(wrong))
    return sum(length for length in lengths if length * STRIDE > WRONG)
