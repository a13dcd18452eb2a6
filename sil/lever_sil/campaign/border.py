"""Where tracking fails: the border along the x axis of a map, with the band in which it lies in 95 % of campaigns.

The band is by bootstrap (B. Efron, Annals of Statistics 7, 1979): runs of each cell are drawn with replacement, the
border of each draw is found, and the band is from the 2.5th to the 97.5th percentile of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

from .cells import Map, Runs
from .spec import Failure

DRAWS = 400
_SEED = 1
_BLOCK = 2_000_000  # numbers drawn at a time


@dataclass(frozen=True)
class Border:
    """Of an estimator in a row of a panel. Infinite: beyond the map, on that side."""

    estimator: str
    panel: int
    y: int
    at: float
    """On the x axis, in its unit."""
    low: float
    high: float
    cause: str
    """"error" or "coverage", whichever fails first; empty where neither does."""


def borders(cells: Map, failure: Failure) -> Iterator[Border]:
    """Yield where, from the first cell of the x axis on, the error or the coverage is first beyond its limit.

    Only rows without an empty cell have a border.
    """
    rng = np.random.Generator(np.random.Philox(_SEED))
    for name, runs in cells.runs.items():
        for panel in range(len(cells.panels.values)):
            for y in range(len(cells.y.values)):
                row = [each for x in range(len(cells.x.values)) if (each := runs.get((panel, y, x)))]
                if len(row) == len(cells.x.values):
                    yield _border(cells, name, panel, y, row, failure, rng)


def _border(
    cells: Map, name: str, panel: int, y: int, row: list[Runs], failure: Failure, rng: np.random.Generator
) -> Border:
    position = cells.x.position
    drawn = [_draws(runs, rng) for runs in row]
    errors, covered = (np.stack([each[part] for each in drawn], axis=-1) for part in (0, 1))
    of_error = crossing(np.log(errors), math.log(failure.error), position)
    of_coverage = crossing(-covered, -failure.coverage, position)
    low, high = np.percentile(np.minimum(of_error, of_coverage)[1:], (2.5, 97.5), method="nearest")
    at = float(min(of_error[0], of_coverage[0]))
    cause = "" if at == math.inf else "error" if of_error[0] <= of_coverage[0] else "coverage"
    at, low, high = (cells.x.value(float(each)) if math.isfinite(each) else float(each) for each in (at, low, high))
    return Border(name, panel, y, at, low, high, cause)


def _draws(runs: Runs, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return (1 + DRAWS,) error and coverage of a cell: of its runs, and of draws of as many of them."""
    count = len(runs.error)
    errors, covered = [np.median(runs.error, keepdims=True)], [runs.coverage.mean(axis=0).min(keepdims=True)]
    block = max(1, _BLOCK // count)
    for first in range(0, DRAWS, block):
        chosen = rng.integers(count, size=(min(block, DRAWS - first), count))
        errors.append(np.median(runs.error[chosen], axis=1))
        covered.append(runs.coverage[chosen].mean(axis=1).min(axis=1))
    return np.concatenate(errors), np.nan_to_num(np.concatenate(covered), nan=1.0)  # no σ, no coverage to fail


def crossing(values: Array, limit: float, position: Array) -> Array:
    """Return (B,) where values (B, n) at the positions (n,) first go beyond the limit, straight between two of them.

    -inf where the first is beyond already, inf where none is.
    """
    beyond = values > limit
    first = beyond.argmax(axis=1)
    row, before = np.arange(len(values)), np.maximum(first - 1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        part = (limit - values[row, before]) / (values[row, first] - values[row, before])
    part = np.where(np.isfinite(part), part, 0.0)
    between = position[before] + part * (position[first] - position[before])
    at: Array = np.where(beyond.any(axis=1), np.where(first == 0, -np.inf, between), np.inf)
    return at
