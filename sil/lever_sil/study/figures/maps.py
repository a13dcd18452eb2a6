"""A figure of maps: values over two scales, a chart for each of several rows and columns, with a line across each.

As description is for figures over time; printed, plotted and data draw both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

TICKS = 4
"""Of an axis, at most."""
RED = "#e63c3c"
"""Colour of a line."""


@dataclass(frozen=True)
class Scale:
    """An axis of a map."""

    label: str
    """With its unit."""
    values: tuple[float | str, ...]
    """Of its cells; the middle of a bin."""
    is_log: bool = False

    @property
    def shown_label(self) -> str:
        """Return the label as charts have it."""
        return self.label.replace("sqrt(s)", "√s")

    @property
    def position(self) -> Array:
        """Return the positions of the cells, evenly spaced where the scale is even.

        Names stand at 0, 1, 2 …
        """
        if self.is_named:
            return np.arange(len(self.values), dtype=np.float64)
        numbers = np.array(self.values, dtype=np.float64)
        return np.log(numbers) if self.is_log else numbers

    @property
    def is_named(self) -> bool:
        """Whether its values are names."""
        return any(isinstance(value, str) for value in self.values)

    @property
    def edges(self) -> Array:
        """Of the cells, in positions."""
        at = self.position
        if len(at) == 1:
            return np.array([at[0] - 0.5, at[0] + 0.5])
        middle = 0.5 * (at[1:] + at[:-1])
        return np.concatenate(([2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]))

    def ticks(self, most: int) -> list[int]:
        """Return indices of values that are written at the axis, both ends among them; evenly spaced where possible."""
        last = len(self.values) - 1
        count = max((count for count in range(3, most + 1) if last % (count - 1) == 0), default=most)
        return sorted({round(at) for at in np.linspace(0.0, last, count)})

    def value(self, position: float) -> float:
        """Return what is at a position; infinities and NaN stay."""
        return float(np.exp(position)) if self.is_log else position

    def place(self, values: Array) -> Array:
        """Return positions of values; what is beyond the scale is at its edge."""
        with np.errstate(divide="ignore", invalid="ignore"):
            positions = np.log(np.maximum(values, 0.0)) if self.is_log else values
        clipped: Array = np.clip(positions, *np.sort(self.position[[0, -1]]))
        return clipped


@dataclass(frozen=True)
class Line:
    """Across a map: where on the x axis it is, with a band around it."""

    rows: tuple[int, ...]
    """Of the map; indices of the y scale."""
    at: Array
    """Of each of them, in the unit of the x axis; infinite beyond the map."""
    low: Array
    high: Array


@dataclass(frozen=True)
class Chart:
    """A map."""

    values: Array
    """(y, x); NaN for an empty cell."""
    line: Line | None


@dataclass(frozen=True)
class MapFigure:
    """All that is drawn and said."""

    name: str
    title: str
    caption: str
    label: str
    """Of what the colours mean, with unit."""
    limits: tuple[float, float]
    """Of the colours."""
    more_is_better: bool
    rows: tuple[str, ...]
    """Titles of the rows of charts, from above."""
    columns: Scale
    """Of the columns of charts: one without label and value where there is only one."""
    x: Scale
    y: Scale
    charts: tuple[tuple[Chart, ...], ...]
    """By row and column."""


def written(value: float | str, digits: int = 2) -> str:
    """Return a value of a scale; a number with at least so many digits, and no exponent where it is large."""
    if isinstance(value, str):
        return value
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text else text


def across(scale: Scale, line: Line) -> tuple[Array, Array, Array]:
    """Return low end, line and high end as positions.

    The band ends at the edge of the map; a line that is beyond it is NaN.
    """
    low, at, high = (scale.place(each) for each in (line.low, line.at, line.high))
    return low, np.where(np.isfinite(line.at), at, np.nan), high
