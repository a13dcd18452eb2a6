"""Maps of errors, coverage, consistency and settling over the design, with the border where tracking fails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

from ..study.figures.maps import Chart, Line, MapFigure
from . import cells as statistics
from .border import Border
from .cells import Map, Runs


@dataclass(frozen=True)
class _Quantity:
    """What is mapped."""

    key: str
    title: str
    label: str
    statistic: Callable[[Runs], float]
    scale: float
    limits: tuple[float, float]
    caption: str
    more_is_better: bool = False


_QUANTITIES = (
    _Quantity(
        "error", "Error", "rms error of the worst parameter [%]", statistics.error, 100.0, (0.0, 50.0),
        "The largest rms error of a parameter in a run, relative to the truth: median over the runs of a cell; white "
        "where most failed.",
    ),
    _Quantity(
        "coverage", "Coverage", "coverage of ±2σ [%]", statistics.coverage, 100.0, (50.0, 100.0),
        "Share of the time for which ±2σ holds the truth, of the parameter that has the least: 95 % is right.",
        more_is_better=True,
    ),
    _Quantity(
        "nees", "NEES", "NEES (expected 3)", statistics.nees, 1.0, (0.0, 12.0),
        "Normalised squared error of the three parameters: 3 is right, more is over-confident; empty for an estimator "
        "without standard deviations.",
    ),
    _Quantity(
        "settled", "Settling", "settling time [s]", statistics.settled, 1.0, (0.0, 60.0),
        "Time until the error of the natural frequency stays within 5 %: median; empty where most runs never do.",
    ),
    _Quantity(
        "flagged", "Flagged", "flagged [%]", statistics.flagged, 100.0, (0.0, 100.0),
        "Share of the time with a fault that says that the estimates are not to be trusted; empty for an estimator "
        "without faults.",
    ),
)  # fmt: skip

_LINE = "Line: the border where tracking fails, with its 95 % band; none where it lies beyond the map."


def figures(cells: Map, borders: Sequence[Border]) -> list[MapFigure]:
    """Return the error, and each other quantity that any estimator has."""
    panels = range(len(cells.panels.values))
    lines = {(name, panel): _line(cells, borders, name, panel) for name in cells.runs for panel in panels}
    maps: list[MapFigure] = []
    for each in _QUANTITIES:
        charts = tuple(
            tuple(Chart(_values(cells, each, name, panel), lines[name, panel]) for panel in panels)
            for name in cells.runs
        )
        if not maps or any(np.isfinite(chart.values).any() for row in charts for chart in row):
            caption = f"{each.caption} {_LINE}"
            figure = MapFigure(f"map_{each.key}", each.title, caption, each.label, each.limits, each.more_is_better,
                               tuple(cells.runs), cells.panels, cells.x, cells.y, charts)  # fmt: skip
            maps.append(figure)
    return maps


def _values(cells: Map, quantity: _Quantity, name: str, panel: int) -> Array:
    """Return (y, x) in the unit of the quantity."""
    values = cells.array(name, panel, quantity.statistic)
    return np.where(np.isfinite(values), quantity.scale * values, np.nan)


def _line(cells: Map, borders: Sequence[Border], name: str, panel: int) -> Line | None:
    """None where a line has nowhere to go."""
    own = [each for each in borders if each.estimator == name and each.panel == panel]
    if len(own) < 2 or cells.x.is_named:
        return None
    at, low, high = (np.array([getattr(each, part) for each in own]) for part in ("at", "low", "high"))
    return Line(tuple(each.y for each in own), at, low, high)
