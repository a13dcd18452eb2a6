"""Runs firmware and joint filters on the logs of the conditions, in processes, and brings back figures of each run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.runtime import interrupts

from ...batch.firmware import Track
from ...envelope import conditions
from ...envelope.condition import Condition
from ...envelope.measure import FIGURES, Outcome
from .filters import JOINT_FILTERS, tracks
from .logs import Log, chunks, logs

FIRMWARE = "firmware"
ESTIMATORS = (FIRMWARE, *JOINT_FILTERS)

Progress = Callable[[int, int, str], None]
"""Called after each chunk: conditions done, of how many, and the last of them."""


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
    """Conditions that are run together."""

    conditions: tuple[str, ...]
    seeds: int
    estimators: tuple[str, ...]


def figures(condition: Condition) -> tuple[str, str]:
    """Return which figures of `lever envelope` are compared."""
    of = "f_n" if condition.motion.pilot == "arm" else "θ/z̈"
    return f"{of} rms", f"{of} covered"


def tasks(chosen: Iterable[Condition], seeds: int, estimators: Sequence[str]) -> list[Task]:
    """Return all there is to do."""
    return [Task(tuple(one.name for one in chunk), seeds, tuple(estimators)) for chunk in chunks(chosen, seeds)]


def run(todo: list[Task], jobs: int, progress: Progress | None = None) -> list[EstimatorResult]:
    """Do all tasks, in `jobs` processes. Interrupted, it leaves no process behind."""
    total, done = sum(len(task.conditions) for task in todo), 0
    collected: list[EstimatorResult] = []
    for task, results in interrupts.in_processes(do, todo, jobs):
        collected += results
        done += len(task.conditions)
        if progress is not None:
            progress(done, total, task.conditions[-1])
    order = list(conditions.CONDITIONS)
    return sorted(collected, key=lambda result: (order.index(result.condition), ESTIMATORS.index(result.estimator)))


def do(task: Task) -> tuple[Task, list[EstimatorResult]]:
    """Do one task."""
    ready = list(logs([conditions.CONDITIONS[name] for name in task.conditions], task.seeds))
    results = []
    for name in task.estimators:
        estimated = [log.firmware for log in ready] if name == FIRMWARE else tracks(ready, JOINT_FILTERS[name])
        results += [_result(log, name, track) for log, track in zip(ready, estimated, strict=True) if track is not None]
    return task, results


def _result(log: Log, estimator: str, track: Track) -> EstimatorResult:
    outcome = Outcome(log.recording, track, log.condition.window)
    with np.errstate(all="ignore"):  # of runs that broke down
        rms, covered = (FIGURES[figure].compute(outcome) for figure in figures(log.condition))
    return EstimatorResult(log.condition.name, estimator, np.where(np.isfinite(rms), rms, np.inf), covered)
