"""What is in a figure, said once for print and for a browser.

Text is written plainly, with an underscore before an index: m_p, k_p, a_21. Whoever draws it sets it in type.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from lever_cdkf.numeric.arrays import Array

_MARGIN = 0.05  # of a y axis, above and below


@dataclass(frozen=True)
class Look:
    """How something is drawn wherever it appears."""

    colour: str
    """A name of report/page.css or figures.css."""
    width: float = 1.8
    """Of its line [pixels of the page]."""
    dash: str = "solid"
    """ "solid", "dash", "dot" or "dashdot"."""


LOOKS: Mapping[str, Look] = {
    "truth": Look("truth", 1.6, "dash"),
    "estimate": Look("estimate"),
    "estimate-edge": Look("estimate", 0.8),
    "estimate-band": Look("estimate-band"),
    "joint": Look("joint", 1.8, "dash"),
    "joint-edge": Look("joint", 0.9, "dash"),
    "reference": Look("reference-band"),
    "chance": Look("chance-band"),
    "measured": Look("measured"),
    "signal": Look("truth", 1.2),
    "without": Look("joint", 1.6, "dash"),
    "many": Look("chance-band"),
    "median": Look("estimate"),
    "expected": Look("mark", 1.2, "dot"),
}
"""Told apart by lightness, dashes or shape too, not by hue alone."""


@dataclass(frozen=True)
class Curve:
    """y over x, as a line."""

    x: Array
    y: Array
    name: str
    look: str


@dataclass(frozen=True)
class Points:
    """y over x, as dots."""

    x: Array
    y: Array
    name: str
    look: str


@dataclass(frozen=True)
class Band:
    """Between two curves: filled, or only its edges."""

    x: Array
    low: Array
    high: Array
    name: str
    look: str
    filled: bool = True


Trace = Curve | Points | Band


@dataclass(frozen=True)
class Row:
    """A chart; those of a column share the x axis, those side by side the y axis."""

    label: str
    """Of the y axis, with unit."""
    traces: tuple[Trace, ...]
    limits: tuple[float, float] | None = None
    """Of the y axis; None: what is drawn."""


@dataclass(frozen=True)
class Surface:
    """Magnitude over time and frequency."""

    time: Array
    """(T,) [s]"""
    frequency: Array
    """(F,) [Hz]"""
    magnitude: Array
    """(F, T)"""
    label: str
    """Of the magnitude, with unit."""
    ridge: Array
    """(T,) a frequency [Hz] to be followed over the surface."""
    ridge_magnitude: Array
    """(T,) the magnitude there."""
    ridge_name: str


@dataclass(frozen=True)
class Column:
    """Charts above each other, or one surface."""

    title: str
    """Empty where there is one column only."""
    content: tuple[Row, ...] | Surface


@dataclass(frozen=True)
class Figure:
    """All that is drawn and said."""

    name: str
    title: str
    caption: str
    columns: tuple[Column, ...]
    x_range: tuple[float, float]
    """Of time [s]."""
    marks: tuple[float, ...] = ()
    """Times [s] of a change of the truth."""
    scaled_from: float = 0.0
    """Time [s]: what comes before may leave the charts, so that a wild start does not squeeze the rest."""
    row_height: float = 1.0
    """[inches] in print."""

    def brightest(self) -> float:
        """Return greatest magnitude of all surfaces, which share one scale."""
        surfaces = [column.content for column in self.columns if isinstance(column.content, Surface)]
        return max(float(np.nanmax(surface.magnitude)) for surface in surfaces)

    def limits(self) -> list[tuple[float, float]]:
        """Return the limits of the y axes, row by row.

        They are what any column says, or all that is drawn from `scaled_from` on, and a margin.
        """
        columns = [column.content for column in self.columns if not isinstance(column.content, Surface)]
        since = max(self.x_range[0], self.scaled_from)
        return [rows[0].limits or _limits(rows, since) for rows in zip(*columns, strict=True)]


def _limits(rows: tuple[Row, ...], since: float) -> tuple[float, float]:
    drawn = [edge[trace.x >= since] for row in rows for trace in row.traces for edge in _edges(trace)]
    values = np.concatenate(drawn)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = _MARGIN * ((high - low) or abs(high) or 1.0)
    return low - margin, high + margin


def _edges(trace: Trace) -> tuple[Array, ...]:
    return (trace.low, trace.high) if isinstance(trace, Band) else (trace.y,)


def interval(x: Array, centre: Array, sigma: Array, name: str, look: str, *, filled: bool = True) -> Band:
    """Return the interval centre ± 2 sigma."""
    return Band(x, centre - 2.0 * sigma, centre + 2.0 * sigma, name, look, filled)


def tracked(x: Array, truth: Array, estimate: Array, sigma: Array) -> tuple[Trace, ...]:
    """Return a quantity that is estimated, its truth, and what the estimator says of it."""
    return (
        interval(x, estimate, sigma, "estimate ± 2σ", "estimate-band"),
        Curve(x, estimate, "estimate", "estimate"),
        Curve(x, truth, "truth", "truth"),
    )


def number(value: float, digits: int = 2) -> str:
    """`value` with so many digits that count, and no exponent."""
    return f"{Decimal(f'{value:.{digits}g}'):,f}"


def percent(share: float, digits: int = 2) -> str:
    """Return a part of 1, in percent."""
    return f"{number(100.0 * share, digits)} %"
