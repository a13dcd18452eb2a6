"""Runs firmware and joint filters on the logs of the conditions, in processes, and brings back figures of each run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

from ...batch.firmware import Track
from ...envelope import conditions
from ...envelope.condition import Condition
from ...envelope.measure import FIGURES, Outcome
from ...run.seeds import Progress, in_processes
from .filters import JOINT_FILTERS, track
from .logs import Log, log_of

FIRMWARE = "firmware"
ESTIMATORS = (FIRMWARE, *JOINT_FILTERS)


@dataclass(frozen=True)
class EstimatorResult:
    """An estimator in a condition: one value a run. What broke down has an infinite error and covers nothing."""

    condition: str
    estimator: str
    rms: Array
    """Of the natural frequency [%], or of theta/z_ddot where the pilot has none."""
    covered: Array
    """Share of time in which it is within ±2σ [%]."""


@dataclass(frozen=True)
class Task:
    """A condition, and who is run on its log."""

    condition: str
    seeds: int
    estimators: tuple[str, ...]

    def __str__(self) -> str:
        return self.condition


def figures(condition: Condition) -> tuple[str, str]:
    """Return which figures of `lever envelope` are compared."""
    of = "f_n" if condition.motion.pilot == "arm" else "θ/z̈"
    return f"{of} rms", f"{of} covered"


def run(
    chosen: Iterable[str], seeds: int, estimators: Sequence[str], jobs: int, progress: Progress | None = None
) -> list[EstimatorResult]:
    """Run estimators on the conditions, in `jobs` processes. Interrupted, it leaves no process behind."""
    todo = [Task(name, seeds, tuple(estimators)) for name in chosen]
    return [result for results in in_processes(do, todo, jobs, progress) for result in results]


def do(task: Task) -> list[EstimatorResult]:
    """Do one task."""
    log = log_of(conditions.CONDITIONS[task.condition], task.seeds)
    results = []
    for name in task.estimators:
        estimated = log.firmware if name == FIRMWARE else track(log, JOINT_FILTERS[name])
        results += [] if estimated is None else [_result(log, name, estimated)]
    return results


def _result(log: Log, estimator: str, track: Track) -> EstimatorResult:
    outcome = Outcome(log.recording, track, log.condition.window)
    with np.errstate(all="ignore"):  # of runs that broke down
        rms, covered = (FIGURES[figure].compute(outcome) for figure in figures(log.condition))
    return EstimatorResult(log.condition.name, estimator, np.where(np.isfinite(rms), rms, np.inf), covered)
