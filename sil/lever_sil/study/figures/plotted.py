"""Figures for a browser: the renderer by plotly.js, whose JSON a page draws by page.js."""

from __future__ import annotations

import html
import math
from itertools import product
from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report import figure as chart
from lever_cdkf.report.series import packed
from lever_cdkf.report.typesetting import in_html

from .description import LOOKS, Band, Column, Figure, Points, Surface, Trace
from .maps import RED, TICKS, Line, MapFigure, Scale, across, written

_INCH, _ROOM = 130, 110  # [pixels] of a chart for an inch in print, and for legend and x axis
_DOT = 2.5  # [pixels]
_BUTTONS = {"orientation": "v", "bgcolor": "rgba(0,0,0,0)", "color": "@quiet", "activecolor": "@text"}
_MARGIN = {"l": 60, "r": 36, "t": 44, "b": 44}  # [pixels], with room for the buttons beside the chart
_SURFACE = 430  # [pixels]
_SCENE_FONT = {"family": "sans-serif", "size": 12}  # in three dimensions no font is inherited
_LIFT = 1.01  # of a curve over the surface that it follows
_CELL, _TITLE, _FOOT = 170, 60, 60  # [pixels] of a map, and above and below all maps
_LETTER, _LABEL = 7, 44  # [pixels] left of all, for a letter of a tick of the y axis and for the label
_GAP = 0.03  # between maps, at least, as part of the whole


def spec(figure: Figure, column: Column) -> chart.Spec:
    """For plotly.js, by page.js."""
    if isinstance(column.content, Surface):
        return _surface(column.content, column.title, figure.brightest())
    rows = [
        chart.axis(in_html(row.label), range=list(limits))
        for row, limits in zip(column.content, figure.limits(), strict=True)
    ]
    drawn = chart.Figure(
        rows,
        chart.axis("time [s]", range=list(figure.x_range)),
        round(_INCH * figure.row_height) * len(rows) + _ROOM,
    )
    drawn.more |= {"modebar": _BUTTONS, "margin": _MARGIN}
    drawn.over_time = False  # the runs of different figures have nothing to do with each other
    for index, row in enumerate(column.content):
        for trace in row.traces:
            drawn.add(*_traces(trace, index))
    drawn.mark(list(figure.marks))
    return drawn.spec()


def _traces(trace: Trace, row: int) -> list[chart.Spec]:
    look, name = LOOKS[trace.look], in_html(trace.name)
    style = {"line_width": look.width, "line_dash": look.dash}
    if isinstance(trace, Points):
        marker = {"color": f"@{look.colour}", "size": _DOT}
        return [chart.dots(trace.x, trace.y, name, look.colour, row, marker=marker)]
    if isinstance(trace, Band) and trace.filled:
        return chart.band(trace.x, trace.low, trace.high, name, look.colour, row)
    if isinstance(trace, Band):
        edges = (trace.high, trace.low)
        return [chart.line(trace.x, edge, name, look.colour, row, **style, hoverinfo="skip") for edge in edges]
    return [chart.line(trace.x, trace.y, name, look.colour, row, **style, hovertemplate="%{y:.4g}")]


def _surface(surface: Surface, title: str, brightest: float) -> chart.Spec:
    """Return a surface that can be turned, with a curve on it; `brightest` is the end of the scale of all of them."""
    look: chart.Spec = {"backgroundcolor": "rgba(0,0,0,0)", "gridcolor": "@edge", "zerolinecolor": "@edge"}
    look |= {"color": "@text", "tickfont": _SCENE_FONT}
    shown = {
        "type": "surface",
        "name": title,
        "x": packed(surface.time),
        "y": packed(surface.frequency),
        "z": packed(surface.magnitude),
        "cmin": 0.0,
        "cmax": brightest,
        "colorscale": "Viridis",
        "showscale": False,
        "hovertemplate": "%{x:.1f} s, %{y:.2f} Hz: %{z:.3g} deg per m/s²<extra></extra>",
    }
    ridge = {
        "type": "scatter3d",
        "mode": "lines",
        "name": surface.ridge_name,
        "x": packed(surface.time),
        "y": packed(surface.ridge),
        "z": packed(_LIFT * surface.ridge_magnitude),
        "line": {"color": "@fault", "width": 5},
        "hovertemplate": "%{x:.1f} s: natural frequency %{y:.2f} Hz<extra></extra>",
    }
    scene = {
        "xaxis": look | {"title": {"text": "time [s]", "font": _SCENE_FONT}},
        "yaxis": look | {"title": {"text": "frequency [Hz]", "font": _SCENE_FONT}},
        "zaxis": look | {"title": {"text": in_html(surface.label), "font": _SCENE_FONT}, **_heights(brightest)},
        "aspectmode": "manual",
        "aspectratio": {"x": 1.05, "y": 1.05, "z": 0.6},
        "camera": {"eye": {"x": 0.95, "y": -1.6, "z": 1.45}, "center": {"x": 0.0, "y": 0.0, "z": -0.1}},
        "dragmode": "turntable",
    }
    layout = {"height": _SURFACE, "scene": scene, "hovermode": "closest", "showlegend": False}
    layout |= {"margin": {"l": 0, "r": 0, "t": 10, "b": 0}, "modebar": _BUTTONS}
    return {"data": [shown, ridge], "layout": layout, "over_time": False}


def _heights(greatest: float) -> chart.Spec:
    """Return an axis from 0 to `greatest` without a label at 0, which would lie on those of the other axes."""
    step = 10.0 ** math.floor(math.log10(greatest))
    return {"range": [0.0, greatest], "tickvals": [step * count for count in range(1, int(greatest / step) + 1)]}


# --- maps ------------------------------------------------------------------------------------------------------------


def map_spec(figure: MapFigure) -> chart.Spec:
    """For plotly.js, by page.js."""
    down, across = len(figure.rows), len(figure.columns.values)
    layout: chart.Spec = {"height": _CELL * down + _TITLE + _FOOT, "hovermode": "closest", "showlegend": False}
    left = _LABEL + _LETTER * max(len(written(value)) for value in figure.y.values)
    layout |= {
        "margin": {"l": left, "r": 12, "t": _TITLE, "b": _FOOT},
        "annotations": [_beside(figure.y.shown_label, left)],
    }
    data: list[chart.Spec] = []
    for number, (row, column) in enumerate(product(range(down), range(across)), 1):
        suffix = "" if number == 1 else str(number)
        place = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        x, y = _domain(column, across), _domain(down - 1 - row, down)
        last, first = row == down - 1, column == 0
        layout[f"xaxis{suffix}"] = _map_axis(figure.x, ticks=last, label=last) | {"domain": x, "anchor": place["yaxis"]}
        layout[f"yaxis{suffix}"] = _map_axis(figure.y, ticks=first) | {"domain": y, "anchor": place["xaxis"]}
        layout["annotations"].append(_heading(figure, row, column, x[0], y[1]))
        drawn = figure.charts[row][column]
        traces = [_heat(figure, drawn.values, with_bar=number == 1), *_border(figure, drawn.line)]
        data += [trace | place for trace in traces]
    return {"data": data, "layout": layout, "over_time": False}


def _domain(index: int, count: int) -> list[float]:
    gap = 0.0 if count == 1 else max(_GAP, 0.12 / count)
    width = (1.0 - gap * (count - 1)) / count
    return [index * (width + gap), index * (width + gap) + width]


def _map_axis(scale: Scale, *, ticks: bool, label: bool = False) -> chart.Spec:
    places, shown = _places(scale), scale.ticks(TICKS)
    more: dict[str, Any] = {"showticklabels": ticks, "showgrid": False, "zeroline": False, "ticks": ""}
    more |= {"tickvals": places[shown].tolist(), "ticktext": [written(scale.values[index]) for index in shown]}
    edges = np.sort(scale.edges[[0, -1]])  # also where nothing is drawn
    more["range"] = (edges / math.log(10.0) if scale.is_log else edges).tolist()
    if scale.is_log:
        more["type"] = "log"
    return chart.axis(html.escape(scale.shown_label) if label else "", **more)


def _places(scale: Scale) -> Array:
    """Where plotly.js, which takes the logarithm itself, has the cells."""
    return scale.position if scale.is_named else np.array(scale.values, dtype=np.float64)


def _beside(label: str, left: int) -> chart.Spec:
    """Return the label of the y axis of all charts: one chart may be less high than it is long."""
    place = {"x": 0.0, "y": 0.5, "xref": "paper", "yref": "paper", "xshift": 14 - left, "textangle": -90}
    return {"text": html.escape(label), "showarrow": False, "font": {"size": 12}} | place


def _heading(figure: MapFigure, row: int, column: int, x: float, y: float) -> chart.Spec:
    value = figure.columns.values[column]
    where = "" if value == "" else f", {figure.columns.label} {written(value)}"
    place = {"x": x, "y": y, "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    return {"text": html.escape(f"{figure.rows[row]}{where}"), "showarrow": False, "font": {"size": 11}} | place


def _heat(figure: MapFigure, values: Array, *, with_bar: bool) -> chart.Spec:
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


def _border(figure: MapFigure, line: Line | None) -> list[chart.Spec]:
    """Return the line and its band."""
    if line is None:
        return []
    y = _places(figure.y)[list(line.rows)].tolist()
    low, at, high = ([figure.x.value(each) for each in x] for x in across(figure.x, line))
    look = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
    shown = {"mode": "lines+markers", "marker": {"color": RED, "size": 5}, "line": {"color": RED, "width": 2.5}}
    around = {"x": [*low, *reversed(high)], "y": [*y, *reversed(y)]}
    return [
        look | around | {"fill": "toself", "fillcolor": "rgba(230,60,60,0.25)", "line": {"width": 0}},
        look | shown | {"x": [None if math.isnan(each) else each for each in at], "y": y},
    ]
