"""Statistics of the cells of a campaign's map: runs at the same point of a grid, or near each other in another design.

The last axis of a spec is x, the one before y, the third from the end makes panels; what else varies is pooled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.firmware.quantities import DYNAMICS, parameters
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..study.figures.maps import Scale
from .axis import Axis
from .chunks import Plan
from .summary import table

BINS = 8
"""Of an axis of a design that is no grid."""


@dataclass(frozen=True)
class Runs:
    """The runs of an estimator in a cell."""

    error: Array
    """(n,) the largest rms error of what is judged; infinite for runs that failed or diverged."""
    coverage: Array
    """(n, q) share of the time with the truth within ±2σ, of each; 0 for these, NaN where no σ is stated."""
    nees: Array
    settled: Array
    """[s]; infinite: never."""
    flagged: Array
    failed: NDArray[np.bool_]


@dataclass(frozen=True)
class Map:
    """All runs of a campaign by cell."""

    panels: Scale
    y: Scale
    x: Scale
    judged: tuple[str, ...]
    """Names of the quantities in `error` and `coverage`."""
    runs: dict[str, dict[tuple[int, int, int], Runs]]
    """By estimator, and panel, y, x."""

    def array(self, estimator: str, panel: int, statistic: Callable[[Runs], float]) -> Array:
        """Return (y, x) of a function of Runs; NaN for an empty cell."""
        cells = self.runs[estimator]
        values = np.full((len(self.y.values), len(self.x.values)), np.nan)
        for (at, row, column), runs in cells.items():
            if at == panel:
                values[row, column] = statistic(runs)
        return values


def error(runs: Runs) -> float:
    """Return median over runs."""
    return float(np.median(runs.error))


def coverage(runs: Runs) -> float:
    """Return the coverage of the quantity that has the least, over all runs; NaN where no σ is stated."""
    return float(np.min(np.mean(runs.coverage, axis=0)))


def nees(runs: Runs) -> float:
    """Return mean over runs."""
    finite = runs.nees[np.isfinite(runs.nees)]
    return float(np.mean(finite)) if len(finite) else math.nan


def settled(runs: Runs) -> float:
    """Return median over runs [s]."""
    return float(np.median(runs.settled))


def flagged(runs: Runs) -> float:
    """Return mean over runs; NaN for an estimator that flags nothing."""
    finite = runs.flagged[np.isfinite(runs.flagged)]
    return float(np.mean(finite)) if len(finite) else math.nan


_ONE = Scale("", ("",))


def read(plan: Plan, folder: Path) -> Map:
    """Return all that is there of a campaign."""
    axes = plan.spec.vary[-3:]
    given = {axis.key: _scale(plan, axis) for axis in axes}
    scales = [_ONE] * (3 - len(axes)) + list(given.values())
    panels, y, x = scales
    keys = [None] * (3 - len(axes)) + [axis.key for axis in axes]
    judged = tuple(each.key for each in parameters(plan.model))
    if plan.spec.first.pilot.model != plan.model:  # whose parameters have no true values
        judged = tuple(each.key for each in DYNAMICS)
    runs = {name: dict(_runs(folder, name, keys, scales, judged)) for name in plan.spec.estimators}
    return Map(panels, y, x, judged, runs)


def _scale(plan: Plan, axis: Axis) -> Scale:
    label = f"{axis.label} [{axis.unit}]" if axis.unit else axis.label
    if plan.spec.design == "grid" or axis.values:
        return Scale(label, tuple(axis.column(axis.of_grid(index)) for index in range(axis.size)), axis.scale == "log")
    middles = [axis.at((index + 0.5) / BINS) for index in range(BINS)]
    return Scale(label, tuple(axis.column(point) for point in middles), axis.scale == "log")


def _runs(
    folder: Path, estimator: str, keys: Sequence[str | None], scales: Sequence[Scale], judged: Sequence[str]
) -> Iterator[tuple[tuple[int, int, int], Runs]]:
    import pyarrow.dataset as ds

    columns = [f"{what}_{name}" for what in ("rms", "coverage") for name in judged]
    columns += ["nees", "settled_s", "flagged", "error", *(key for key in keys if key is not None)]
    rows = table(folder, columns, ds.field("estimator") == estimator)
    failed = ~rows["error"].is_null().to_numpy() if rows.num_rows else np.zeros(0, dtype=np.bool_)

    def numbers(name: str) -> Array:
        values: Array = rows[name].to_numpy().astype(np.float64)
        return values

    errors = np.max(np.stack([numbers(f"rms_{name}") for name in judged]), axis=0)
    diverged = failed | ~np.isfinite(errors)  # also where the estimates' squares are beyond double precision
    covered = np.stack([numbers(f"coverage_{name}") for name in judged], axis=-1)
    settled_s = np.where(np.isnan(numbers("settled_s")), np.inf, numbers("settled_s"))
    covered[diverged] = 0.0
    place = [
        _cell(rows[key].to_numpy(), scale) if key else np.zeros(rows.num_rows, dtype=np.int64)
        for key, scale in zip(keys, scales, strict=True)
    ]
    shape = [len(scale.values) for scale in scales]
    cell = np.ravel_multi_index(place, shape)
    order = np.argsort(cell, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(cell[order])) + 1):
        if len(part):
            at = tuple(int(index) for index in np.unravel_index(cell[part[0]], shape))
            yield (
                (at[0], at[1], at[2]),
                Runs(
                    np.where(diverged, np.inf, errors)[part],
                    covered[part],
                    numbers("nees")[part],
                    settled_s[part],
                    numbers("flagged")[part],
                    failed[part],
                ),
            )


def _cell(values: NDArray[np.generic], scale: Scale) -> NDArray[np.int64]:
    """Return which cell of a scale each value is in: the nearest."""
    if scale.is_named:
        return np.array([scale.values.index(value) for value in values], dtype=np.int64)
    at = np.log(values.astype(np.float64)) if scale.is_log else values.astype(np.float64)
    middles = scale.position
    order = np.argsort(middles)
    edges = 0.5 * (middles[order][1:] + middles[order][:-1])
    return order[np.searchsorted(edges, at)].astype(np.int64)
