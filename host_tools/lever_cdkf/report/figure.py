"""Plotly figures as plain dictionaries (the documented JSON of plotly.js), in the colours and manners of this page.

A colour is a name with "@": page.js puts in what page.css says for it, so a figure follows the light or dark theme.
Several charts in one figure are rows: row 0 on top, all over the same x axis.
"""

import html
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..numeric.arrays import Array
from ..numeric.stretches import runs
from .series import packed

Spec = dict[str, Any]
SERIES = ("estimate", "joint", "fault", "torque", "good", "violet", "text", "quiet", "brown")
"""Colours of many curves of one kind."""
ROW_GAP = 22  # [pixels] between two rows
TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)


def line(x: Array, y: Array, name: str, colour: str, row: int = 0, **more: Any) -> Spec:
    """Return a curve. `more` are further properties of the trace; those of its line start with line_."""
    style = {"color": f"@{colour}", "width": 1.8}
    style |= {key[5:]: more.pop(key) for key in list(more) if key.startswith("line_")}
    return _trace(x, y, name, row) | {"mode": "lines", "line": style} | more


def hover(quantity: str, unit: str = "") -> Spec:
    """Return the text under the pointer, for a trace: what it is, its value, and the unit, "" for none."""
    return {"hovertemplate": f"{quantity} %{{y:.4g}}{unit and ' '}{unit}<extra></extra>"}


def dots(x: Array, y: Array, name: str, colour: str, row: int = 0, **more: Any) -> Spec:
    """Separate points."""
    marker = {"color": f"@{colour}", "size": 4}
    return _trace(x, y, name, row) | {"mode": "markers", "marker": marker} | more


def edges(
    value: Array, sigma: Array, least: float = -math.inf, most: float = math.inf, sigmas: float = 2.0
) -> tuple[Array, Array]:
    """Return the edges of the band of ± `sigmas` standard deviations, cut off at the least and most that can be."""
    return np.clip(value - sigmas * sigma, least, most), np.clip(value + sigmas * sigma, least, most)


def band(x: Array, low: Array, high: Array, name: str, colour: str, row: int = 0) -> list[Spec]:
    """Return the area between two curves: a pair of traces for each stretch without NaN in either."""
    edge = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    filled = {"fill": "tonexty", "fillcolor": f"@{colour}"}  # plotly.js fills wrongly where the traces have gaps
    traces = []
    for first, last in runs(np.isfinite(low) & np.isfinite(high)):
        piece = slice(first, last + 1)
        traces.append(_trace(x[piece], low[piece], name, row) | edge | {"showlegend": False})
        traces.append(_trace(x[piece], high[piece], name, row) | edge | filled)
    return traces


def _trace(x: Array, y: Array, name: str, row: int) -> Spec:
    axis = f"y{row + 1}" if row else "y"
    hover = {"legendrank": 1000 + row, "yhoverformat": ".4g"}  # in the order of the charts
    return {"type": "scatter", "x": packed(x), "y": packed(y), "name": name, "yaxis": axis} | hover


def axis_range(columns: list[Array], settled: slice, share: float = 0.08) -> list[float] | None:
    """Return an axis range that shows all that the columns do in `settled`.

    So a wild start does not squeeze the rest.
    """
    values = np.concatenate([column[settled] for column in columns])
    values = values[np.isfinite(values)]
    if not values.size:
        return None
    low, high = float(values.min()), float(values.max())
    margin = share * ((high - low) or abs(high) or 1.0)
    return [low - margin, high + margin]


@dataclass
class Figure:
    """What page.js draws. `height` in pixels; `x_axis` and each row are the layouts of their axes.

    The share of a row in the height is its "weight", 1 unless it says otherwise.
    """

    rows: list[Spec]
    x_axis: Spec
    height: int = 320
    traces: list[Spec] = field(default_factory=list)
    shapes: list[Spec] = field(default_factory=list)
    annotations: list[Spec] = field(default_factory=list)
    more: Spec = field(default_factory=dict)
    over_time: bool = True
    """Whether x is the time of the run, so that zooming here zooms the other figures over time."""
    choices: Spec = field(default_factory=dict)
    """What choices() has set."""

    def add(self, *traces: Spec) -> None:
        """Add traces; a name that is there already is shown once in the legend."""
        for trace in traces:
            listed = any(trace["name"] == other["name"] and other.get("showlegend", True) for other in self.traces)
            self.traces.append({"showlegend": False} | trace if listed else trace)

    def mark(self, moments: list[float]) -> None:
        """Vertical lines at the times at which the truth changed."""
        for moment in moments:
            style = {"color": "@mark", "width": 1, "dash": "dot"}
            self.shapes.append(
                {"type": "line", "x0": moment, "x1": moment, "y0": 0, "y1": 1, "yref": "paper", "line": style}
            )

    def name_row(self, row: int, text: str) -> None:
        """Put a name, as plain text, above a row, at its left end."""
        where = {"xref": "paper", "x": 0, "xanchor": "left", "yref": f"y{row + 1 if row else ''} domain", "y": 1}
        self.annotations.append({"text": html.escape(text), "showarrow": False, "yanchor": "bottom"} | where)

    def level(self, *values: float) -> None:
        """Dotted lines across the first row at values of its axis."""
        style = {"color": "@mark", "width": 1, "dash": "dot"}
        for value in values:
            ends = {"x0": 0, "x1": 1, "xref": "paper", "y0": value, "y1": value}
            self.shapes.append({"type": "line", "line": style} | ends)

    def choose(self, of: list[Spec], first: int = 0, slider: str = "") -> None:
        """Have the user choose by buttons, or by a slider with that name.

        Each of them is a "label", and "data" and "layout" for Plotly.update of the "traces" (all); `first` is what the
        figure shows as it is.
        """
        self.choices = {"of": of, "first": first, "slider": slider}

    def spec(self) -> Spec:
        """Return the figure for page.js."""
        layout: Spec = {
            "height": self.height,
            "shapes": self.shapes,
            "annotations": self.annotations,
            "xaxis": self.x_axis | {"anchor": "y" if len(self.rows) == 1 else f"y{len(self.rows)}"},
        }
        gap = ROW_GAP / self.height
        weights = [row.get("weight", 1.0) for row in self.rows]
        unit = (1.0 - gap * (len(self.rows) - 1)) / sum(weights)
        top = 1.0
        for index, (row, weight) in enumerate(zip(self.rows, weights, strict=True)):
            bottom = max(0.0, top - unit * weight)
            axis_layout = {key: value for key, value in row.items() if key != "weight"}
            layout[f"yaxis{index + 1}" if index else "yaxis"] = {"domain": [bottom, top]} | axis_layout
            top = bottom - gap
        spec: Spec = {"data": self.traces, "layout": layout | self.more, "over_time": self.over_time}
        return spec | ({"choices": self.choices} if self.choices else {})


def time_axis(end: float) -> Spec:
    """Return an axis from 0 to `end` [s]."""
    return axis("time [s]", range=[0.0, end], unifiedhovertitle={"text": "%{x:.2f} s"})


def frequency_axis(low: float, high: float) -> Spec:
    """Return a logarithmic axis from `low` to `high` [Hz]."""
    limits = [math.log10(low), math.log10(high)]
    hover = {"text": "%{x:.3g} Hz"}
    return axis("frequency [Hz]", type="log", range=limits, tickvals=TICKS, unifiedhovertitle=hover)


def axis(title: str, **more: Any) -> Spec:
    """Return an axis with a title, and what else plotly knows."""
    return {"title": {"text": title}, **more}
