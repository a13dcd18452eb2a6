"""A condition, its limits, and what was measured in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

Values = FloatArray
"""One for each run."""


def mean(values: Values) -> float:
    """Return the mean over all runs."""
    return float(np.mean(values))


def largest(values: Values) -> float:
    """Return the largest over all runs."""
    return float(np.max(values))


def least(values: Values) -> float:
    """Return the least over all runs."""
    return float(np.min(values))


@dataclass(frozen=True)
class Limit:
    """What a figure may be."""

    figure: str
    most: float | None = None
    least: float | None = None
    over: str = "all"
    """Of the runs: "all" pooled, "median", "p90" or "worst"."""

    def holds(self, value: float) -> bool:
        """Return whether a value keeps it; NaN does not."""
        return (self.most is None or value <= self.most) and (self.least is None or value >= self.least)

    def __str__(self) -> str:
        if self.most is None and self.least is None:
            return ""
        bound = f"≤ {self.most:g}" if self.least is None else f"≥ {self.least:g}"
        return bound if self.over == "all" else f"{self.over} {bound}"


@dataclass(frozen=True)
class Figure:
    """Something that is measured in every run."""

    unit: str
    meaning: str
    pool: Callable[[Values], float]
    """All runs as one number."""
    more_is_worse: bool = True
    sought_to: float = math.inf
    """Where it is that much it may be more."""

    def worst(self, values: Values) -> float:
        """Return the worst of all runs."""
        return float(values.max() if self.more_is_worse else values.min())

    def p90(self, values: Values) -> float:
        """No worse than this are nine of ten runs, or more; NaN if any run is."""
        if np.isnan(values).any():
            return math.nan
        best_first = np.sort(values) if self.more_is_worse else np.sort(values)[::-1]
        return float(best_first[math.ceil(0.9 * len(values)) - 1])

    def over(self, values: Values, runs: str) -> float:
        """Return all runs as one number, as `over` of a limit says."""
        if runs == "median":
            return float(np.median(values))
        return {"all": self.pool, "p90": self.p90, "worst": self.worst}[runs](values)


class AcceptanceCondition(Protocol):
    """A row of the table."""

    @property
    def name(self) -> str:
        """The name on the command line."""

    @property
    def title(self) -> str:
        """What is flown, in words."""

    @property
    def limits(self) -> tuple[Limit, ...]:
        """All must hold; without any the row is reported only."""

    @property
    def unless(self) -> tuple[Limit, ...]:
        """Or these."""

    @property
    def quick(self) -> bool:
        """Whether it is a part of --quick."""

    @property
    def figures(self) -> Sequence[str]:
        """All that are measured."""


@dataclass(frozen=True)
class ConditionResult:
    """A condition and what was measured."""

    known: ClassVar[Mapping[str, Figure]]
    """All figures by name."""
    condition: AcceptanceCondition
    values: Mapping[str, Values]
    """Figures, one value a run; empty when it could not be run."""
    problem: str = ""
    """Why it could not be run."""
    runs: Sequence[str] = ()
    """What each run was, where that has a name."""

    def of(self, limit: Limit) -> float:
        """Return what is held against a limit; NaN without runs."""
        if limit.figure not in self.values:
            return math.nan
        return self.known[limit.figure].over(self.values[limit.figure], limit.over)

    def worst_run(self, figure: str) -> str | None:
        """Return the name of the run in which a figure was worst."""
        if not self.runs:
            return None
        values = self.values[figure]
        return self.runs[int(np.argmax(values if self.known[figure].more_is_worse else -values))]

    @property
    def ok(self) -> bool:
        """Whether the limits hold, or those that do instead."""
        if self.problem:
            return False
        condition = self.condition
        held = (all(limit.holds(self.of(limit)) for limit in group) for group in (condition.limits, condition.unless))
        return next(held) or (bool(condition.unless) and next(held))
