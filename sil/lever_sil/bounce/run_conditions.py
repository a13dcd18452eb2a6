"""Runs conditions: each with every aircraft and seed, a task each, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..acceptance.result import ConditionResult
from ..run.seeds import in_processes
from .conditions import CONDITIONS, Condition
from .measure import FIGURES, Excerpt, Measured

Show = Callable[[int, int, str], None]
"""Progress: done, total, what."""


@dataclass(frozen=True)
class BounceResult(ConditionResult):
    """A condition and what was measured."""

    known = FIGURES
    condition: Condition
    excerpt: Excerpt | None = None
    """Of the flight in which its first figure was worst."""


class Task(NamedTuple):
    """One condition, aircraft and pilot."""

    condition: str
    craft: str
    seed: int

    def __str__(self) -> str:
        return self.condition


def measure(task: Task) -> Measured:
    """Fly it. Raise LeverError."""
    return CONDITIONS[task.condition].measure(task.craft, task.seed)


def run(rows: Sequence[Condition], seeds: int, show: Show) -> list[BounceResult]:
    """Return the results of the rows, in their order, with so many pilots.

    Rows that measure the same share the flights.
    """
    flown = {row.measure: row for row in reversed(rows)}
    tasks = [Task(row.name, *flight) for row in flown.values() for flight in _flights(row, seeds)]
    found = iter(in_processes(measure, tasks, os.cpu_count() or 1, show))
    parts = {measured: list(islice(found, len(_flights(row, seeds)))) for measured, row in flown.items()}
    return [_result(row, _flights(row, seeds), parts[row.measure]) for row in rows]


def _flights(row: Condition, seeds: int) -> list[tuple[str, int]]:
    """Return each pilot with each aircraft, or with one of them in turn."""
    if row.in_turn:
        return [(row.aircraft[seed % len(row.aircraft)], seed) for seed in range(seeds)]
    return [(craft, seed) for craft in row.aircraft for seed in range(seeds)]


def _result(row: Condition, flights: Sequence[tuple[str, int]], found: Sequence[Measured]) -> BounceResult:
    values = {name: np.array([each.figures[name] for each in found]) for name in row.figures}
    names = [f"{craft}, pilot {seed}" for craft, seed in flights]
    result = BounceResult(row, values, runs=names)
    worst = names.index(str(result.worst_run(row.figures[0])))
    return replace(result, excerpt=found[worst].excerpt)
