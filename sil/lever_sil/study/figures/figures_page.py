"""All figures for a browser: one page that needs nothing else, in the manner of the report of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lever_cdkf.report import figure as chart
from lever_cdkf.report.page import Page
from lever_cdkf.report.series import packed

from . import maps
from .description import LOOKS, Band, Column, Figure, Points, Surface, Trace
from .maps import MapFigure
from .typesetting import in_html, own_css

_INCH, _ROOM = 130, 110  # [pixels] of a chart for an inch in print, and for legend and x axis
_DOT = 2.5  # [pixels]
_BUTTONS = {"orientation": "v", "bgcolor": "rgba(0,0,0,0)", "color": "@quiet", "activecolor": "@text"}
_MARGIN = {"l": 60, "r": 36, "t": 44, "b": 44}  # [pixels], with room for the buttons beside the chart
_SURFACE = 430  # [pixels]
_SCENE_FONT = {"family": "sans-serif", "size": 12}  # in three dimensions no font is inherited
_LIFT = 1.01  # of a curve over the surface that it follows


def build(figures: Sequence[Figure | MapFigure]) -> str:
    """Return the page; each figure can be linked to by its name, as in figures.html#bode."""
    page = Page(
        "Figures",
        "Simulated runs of the firmware. Errors, times and shares in the captions are measured in these runs.",
        "lever figures",
    )
    for number, figure in enumerate(figures, 1):
        heading = f'<span class="number">{number}.</span> {in_html(figure.title)}'
        caption = f'<p class="caption">{in_html(figure.caption)}</p>'
        page.section(figure.name, figure.name.capitalize(), heading, _charts(page, figure), caption)
    return page.html("", own_css())


def _charts(page: Page, figure: Figure | MapFigure) -> str:
    """Return the charts of a figure, side by side where there is room for them."""
    if isinstance(figure, MapFigure):
        return page.figure(f"{figure.name}-0", maps.spec(figure), "")
    charts = [
        page.figure(f"{figure.name}-{index}", _spec(figure, column), in_html(column.title))
        for index, column in enumerate(figure.columns)
    ]
    return f'<div class="pair">{"".join(charts)}</div>' if len(charts) > 1 else charts[0]


def _spec(figure: Figure, column: Column) -> chart.Spec:
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
        return chart.band(trace.x, trace.low, trace.high, name, look.colour, row, hoverinfo="skip")
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
