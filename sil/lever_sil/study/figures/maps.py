"""A figure of maps: values over two scales, a chart for each of several rows and columns, with a line across each.

As description, printed, figures_page and data are for figures over time: what is drawn, in print, in a browser, and as
a table.
"""

from __future__ import annotations

import csv
import html
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from lever_cdkf.exports import pictures
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.figure import Spec, axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

_TICKS, _TICK = 4, 0.45  # of an axis, at most, and what one takes in print [inches]
_RED = "#e63c3c"
_FLAT, _MOST, _HEADROOM = 0.7, 1.35, 0.75  # height of a chart over its width and at most, and of all else [inches]
_BESIDE = 1.2  # [inches] left and right of the charts
_CELL, _TITLE, _FOOT = 170, 60, 60  # [pixels] of a chart, and above and below all
_LETTER, _LABEL = 7, 44  # [pixels] left of all, for a letter of a tick of the y axis and for the label
_GAP = 0.03  # between charts of the page, at least, as part of the whole


@dataclass(frozen=True)
class Scale:
    """An axis of a map."""

    label: str
    """With its unit."""
    values: tuple[float | str, ...]
    """Of its cells; the middle of a bin."""
    is_log: bool = False

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
        """Return indices of values that are written at the axis, both ends among them."""
        return sorted({round(at) for at in np.linspace(0.0, len(self.values) - 1.0, most)})

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


# --- in print --------------------------------------------------------------------------------------------------------


def sheet(figure: MapFigure, width: str = "single") -> Sheet:
    """Return the figure laid out by matplotlib."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    across = pictures.WIDTHS[width]
    height = min(_MOST, _FLAT * across / len(figure.columns.values))
    ticks = int((across - _BESIDE) / len(figure.columns.values) / _TICK)
    with pictures.style():
        drawn = Sheet(dpi=pictures.RESOLUTION, figsize=(across, height * len(figure.rows) + _HEADROOM))
        drawn.set_layout_engine("constrained")
        FigureCanvasAgg(drawn)
        shape = len(figure.rows), len(figure.columns.values)
        places = drawn.subplots(*shape, sharex=True, sharey=True, squeeze=False)
        for (row, column), place in np.ndenumerate(places):
            colours = _draw(place, figure, figure.charts[row][column])
            place.set_xticks(*_ticks(figure.x, max(2, min(ticks, _TICKS))))
            place.set_yticks(*_ticks(figure.y, _TICKS))
            if column == 0:
                place.set_ylabel(figure.rows[row])
            if row == 0:
                place.set_title(written(figure.columns.values[column]))
        if figure.columns.label:
            drawn.suptitle(figure.columns.label, fontsize=7.5)
        drawn.supxlabel(figure.x.label, fontsize=7.5)
        drawn.supylabel(figure.y.label, fontsize=7.5)
        drawn.colorbar(colours, ax=places, label=figure.label, aspect=30)
        drawn.draw_without_rendering()
        drawn.set_layout_engine("none")  # see printed.sheet()
    return drawn


def _draw(place: Axes, figure: MapFigure, chart: Chart) -> Any:
    """Return the colours, for their bar."""
    low, high = figure.limits
    colours = place.pcolormesh(
        figure.x.edges,
        figure.y.edges,
        np.ma.masked_invalid(chart.values),
        cmap="viridis" if figure.more_is_better else "viridis_r",
        vmin=low,
        vmax=high,
    )
    colours.set_edgecolor("face")  # no seams between the areas of a vector graphic
    place.grid(visible=False)
    if chart.line is not None:
        y = figure.y.position[list(chart.line.rows)]
        left, at, right = across(figure.x, chart.line)
        place.fill_betweenx(y, left, right, color=_RED, alpha=0.3, linewidth=0.0)
        place.plot(at, y, "o-", color=_RED, linewidth=1.4, markersize=2.0)
    return colours


def _ticks(scale: Scale, most: int) -> tuple[Array, list[str]]:
    shown = scale.ticks(most)
    return scale.position[shown], [written(scale.values[index]) for index in shown]


# --- in a browser ----------------------------------------------------------------------------------------------------


def spec(figure: MapFigure) -> Spec:
    """For plotly.js, by page.js."""
    down, across = len(figure.rows), len(figure.columns.values)
    layout: Spec = {"height": _CELL * down + _TITLE + _FOOT, "hovermode": "closest", "showlegend": False}
    left = _LABEL + _LETTER * max(len(written(value)) for value in figure.y.values)
    layout |= {"margin": {"l": left, "r": 12, "t": _TITLE, "b": _FOOT}, "annotations": [_beside(figure.y.label, left)]}
    data: list[Spec] = []
    for number, (row, column) in enumerate(product(range(down), range(across)), 1):
        suffix = "" if number == 1 else str(number)
        place = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        x, y = _domain(column, across), _domain(down - 1 - row, down)
        last, first = row == down - 1, column == 0
        layout[f"xaxis{suffix}"] = _axis(figure.x, ticks=last, label=last) | {"domain": x, "anchor": place["yaxis"]}
        layout[f"yaxis{suffix}"] = _axis(figure.y, ticks=first) | {"domain": y, "anchor": place["xaxis"]}
        layout["annotations"].append(_heading(figure, row, column, x[0], y[1]))
        chart = figure.charts[row][column]
        traces = [_heat(figure, chart.values, with_bar=number == 1), *_line(figure, chart.line)]
        data += [trace | place for trace in traces]
    return {"data": data, "layout": layout, "over_time": False}


def _domain(index: int, count: int) -> list[float]:
    gap = 0.0 if count == 1 else max(_GAP, 0.12 / count)
    width = (1.0 - gap * (count - 1)) / count
    return [index * (width + gap), index * (width + gap) + width]


def _axis(scale: Scale, *, ticks: bool, label: bool = False) -> Spec:
    places, shown = _places(scale), scale.ticks(_TICKS)
    more: dict[str, Any] = {"showticklabels": ticks, "showgrid": False, "zeroline": False, "ticks": ""}
    more |= {"tickvals": places[shown].tolist(), "ticktext": [written(scale.values[index]) for index in shown]}
    if scale.is_log:
        more["type"] = "log"
    return axis(html.escape(scale.label) if label else "", **more)


def _places(scale: Scale) -> Array:
    """Where plotly.js, which takes the logarithm itself, has the cells."""
    return scale.position if scale.is_named else np.array(scale.values, dtype=np.float64)


def _beside(label: str, left: int) -> Spec:
    """Return the label of the y axis of all charts: one chart may be less high than it is long."""
    place = {"x": 0.0, "y": 0.5, "xref": "paper", "yref": "paper", "xshift": 14 - left, "textangle": -90}
    return {"text": html.escape(label), "showarrow": False, "font": {"size": 12}} | place


def _heading(figure: MapFigure, row: int, column: int, x: float, y: float) -> Spec:
    value = figure.columns.values[column]
    where = "" if value == "" else f", {figure.columns.label} {written(value)}"
    place = {"x": x, "y": y, "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    return {"text": html.escape(f"{figure.rows[row]}{where}"), "showarrow": False, "font": {"size": 11}} | place


def _heat(figure: MapFigure, values: Array, *, with_bar: bool) -> Spec:
    return {
        "type": "heatmap",
        "x": _places(figure.x).tolist(),
        "y": _places(figure.y).tolist(),
        "z": [[None if math.isnan(value) else round(float(value), 3) for value in row] for row in values],
        "zmin": figure.limits[0],
        "zmax": figure.limits[1],
        "colorscale": "Viridis",
        "reversescale": not figure.more_is_better,
        "showscale": with_bar,
        "colorbar": {"title": {"text": html.escape(figure.label), "side": "right"}, "thickness": 10, "outlinewidth": 0},
        "hovertemplate": "%{x:.4~g}, %{y:.4~g}: %{z:.4~g}<extra></extra>",
    }


def _line(figure: MapFigure, line: Line | None) -> list[Spec]:
    """Return the line and its band."""
    if line is None:
        return []
    y = _places(figure.y)[list(line.rows)].tolist()
    low, at, high = ([figure.x.value(each) for each in x] for x in across(figure.x, line))
    look = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
    shown = {"mode": "lines+markers", "marker": {"color": _RED, "size": 5}, "line": {"color": _RED, "width": 2.5}}
    around = {"x": [*low, *reversed(high)], "y": [*y, *reversed(y)]}
    return [
        look | around | {"fill": "toself", "fillcolor": "rgba(230,60,60,0.25)", "line": {"width": 0}},
        look | shown | {"x": [None if math.isnan(each) else each for each in at], "y": y},
    ]


# --- as a table ------------------------------------------------------------------------------------------------------


def table(figure: MapFigure) -> str:
    """CSV, a row for each cell, and for each place of a line with its band; -inf and inf: beyond the map."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    titles = (figure.columns.label or "column", "chart", "series", figure.y.label or "y", figure.x.label)
    writer.writerow((*titles, "value", "low", "high"))
    for name, charts in zip(figure.rows, figure.charts, strict=True):
        for value, chart in zip(figure.columns.values, charts, strict=True):
            for (row, column), number in np.ndenumerate(chart.values):
                shown = f"{number:.7g}" if np.isfinite(number) else ""
                writer.writerow((value, name, "", figure.y.values[row], figure.x.values[column], shown, "", ""))
            if chart.line is not None:
                writer.writerows(_border(figure, (value, name, "border"), chart.line))
    return text.getvalue()


def _border(figure: MapFigure, where: Sequence[float | str], line: Line) -> list[tuple[float | str, ...]]:
    return [
        (*where, figure.y.values[row], "", *(f"{value:.6g}" for value in values))
        for row, *values in zip(line.rows, line.at, line.low, line.high, strict=True)
    ]
