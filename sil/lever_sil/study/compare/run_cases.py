"""Runs entrants on cases, in processes, and brings back their errors. Nothing is kept on disk.

A task is a case with an entrant, or with nobody: those are the references. Tasks go case by case, so each process makes
the batch of a case once and keeps it until the next.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ...measures import normalised_squares
from ...run.seeds import Progress, in_processes
from ..data import PARAMETERS, Batch, Estimates
from ..scores import errors
from ..transitions import dynamics_gradient, with_dynamics
from . import dataset
from .cases import Case, Matched, Plan, References, cases
from .entrants import enter, entrants, is_candidate


@dataclass(frozen=True)
class Outcome:
    """What an entrant did in a case: B runs, T times."""

    time: Array
    """(T,) [s]"""
    errors: Array
    """(B, T, 5) as scores.errors."""
    relative: Array
    """(B, T, 5) the same relative to the truth, also for signed parameters."""
    stated: Array | None
    """(B, T, 5) variances that the estimator states of the errors."""
    nees: Array | None
    """(B, T) of the parameters."""
    nis: Array | None
    """(B, T)"""
    seconds: float
    """Processor time of all runs."""
    steps: int
    """Samples of all runs."""


@dataclass(frozen=True)
class Results:
    """All there is of a campaign."""

    plan: Plan
    outcomes: dict[tuple[str, str], Outcome]
    """By names of case and entrant."""
    references: dict[str, References]
    """By name of case, where there are any."""


@dataclass(frozen=True)
class Task:
    """What a process is asked for."""

    case: str
    entrant: str | None
    """None: the references."""
    plan: Plan

    def __str__(self) -> str:
        return f"{self.case}: {self.entrant or 'references'}"


def tasks(chosen: Iterable[str], names: Iterable[str] | None, plan: Plan) -> list[Task]:
    """Return those of the cases `chosen`, for the entrants `names` (None: all there are)."""
    wanted = None if names is None else set(names)
    selected = []
    for name in chosen:
        case = cases()[name]
        taking = [entrant for entrant in entrants(case) if wanted is None or entrant in wanted]
        nobody = [None] if taking and isinstance(case, Matched) else []
        selected += [Task(name, entrant, plan) for entrant in (*nobody, *taking)]
    return selected


def run(todo: list[Task], jobs: int, progress: Progress | None = None) -> Results:
    """Do all tasks, in `jobs` processes. Interrupted, it leaves no process behind."""
    results = Results(todo[0].plan, {}, {})
    for task, result in zip(todo, in_processes(do, todo, jobs, progress), strict=True):
        if isinstance(result, Outcome):
            results.outcomes[task.case, task.entrant or ""] = result
        elif result is not None:
            results.references[task.case] = result
    return results


def do(task: Task) -> Outcome | References | None:
    """Do one task."""
    if task.entrant is not None and is_candidate(task.entrant):
        enter(task.entrant)  # in this process
    case = cases()[task.case]
    batch = _batch(task.case, task.plan)
    at = samples(case, batch)
    if task.entrant is None:
        return case.references(batch, at, task.plan)
    estimator = entrants(case)[task.entrant].make(case)
    start = clock.process_time()
    estimates = estimator(batch, at)
    return outcome(batch, estimates, clock.process_time() - start)


@lru_cache(maxsize=1)
def _batch(case: str, plan: Plan) -> Batch:
    return cases()[case].batch(plan) if plan.data is None else dataset.read(Path(plan.data), case)


def samples(case: Case, batch: Batch) -> NDArray[np.int64]:
    """Return indices of the samples at which estimates are looked at."""
    step = max(1, round(case.every / batch.period))
    return np.arange(step, batch.samples, step, dtype=np.int64)


def outcome(batch: Batch, estimates: Estimates, seconds: float) -> Outcome:
    """Return the outcome of what an estimator made of a batch."""
    at = estimates.at
    with np.errstate(all="ignore"):  # of runs that broke down
        deviations = errors(batch, estimates)
        relative = deviations.copy()
        if not batch.knowledge.positive and batch.truth.p is not None:
            relative[..., :PARAMETERS] *= batch.knowledge.sigma / np.abs(batch.truth.p[:, at])
        stated, nees = _stated(batch, estimates, deviations)
    steps = batch.runs * batch.samples
    return Outcome(at * batch.period, deviations, relative, stated, nees, estimates.nis, seconds, steps)


def _stated(batch: Batch, estimates: Estimates, deviations: Array) -> tuple[Array | None, Array | None]:
    """Return variances (B, T, 5) and NEES of the parameters (B, T), where the estimator and the truth tell them."""
    if estimates.covariance is None or batch.truth.p is None:
        return None, None
    own = np.diagonal(estimates.covariance, axis1=-2, axis2=-1)
    stated = with_dynamics(estimates.covariance, dynamics_gradient(batch, estimates.at, estimates.w))
    intact = np.isfinite(own).all(axis=-1) & (own > 0.0).all(axis=-1)
    covariance = np.where(intact[..., None, None], estimates.covariance, np.eye(PARAMETERS))
    squares = normalised_squares(deviations[..., :PARAMETERS], covariance)
    return stated, np.where(intact, squares, np.nan)
