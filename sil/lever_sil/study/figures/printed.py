"""Figures for print, on white, as wide as one or two columns of a paper: the renderer by matplotlib.

Charts are drawn from the JSON of plotly.js that a page shows. What a page shows otherwise than print, surfaces and
maps, is drawn from its description.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from lever_cdkf.exports import pictures
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.printed import charts, laid_out, legend
from lever_cdkf.report.typesetting import in_mathtext
from lever_cdkf.runtime.provenance import Provenance

from . import plotted
from .description import Figure, Surface
from .maps import RED, TICKS, Chart, MapFigure, Scale, across, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

_HEADROOM = 0.55  # [inches] for legend, column titles and the label of the x axis
_LEVELS = 18  # of a contour, at most
_TICK = 0.45  # [inches] that one takes at the x axis of a map
_FLAT, _MOST, _AROUND = 0.7, 1.35, 0.75  # of a map: height over its width and at most, and of all else [inches]
_BESIDE = 1.2  # [inches] left and right of the maps


def render(
    figure: Figure | MapFigure, kind: str = "png", width: str = "single", provenance: Provenance | None = None
) -> bytes:
    """Return the file, of pictures.KINDS, in one of pictures.WIDTHS; the same figure gives the same bytes."""
    return pictures.render(sheet(figure, width), kind, figure.title, provenance)


def sheet(figure: Figure | MapFigure, width: str = "single") -> Sheet:
    """Return the figure laid out by matplotlib."""
    if isinstance(figure, MapFigure):
        return _maps(figure, width)
    surfaces = [(column.title, column.content) for column in figure.columns if isinstance(column.content, Surface)]
    if surfaces:
        return _surfaces(figure, surfaces, width)
    specs = [(column.title, plotted.spec(figure, column)) for column in figure.columns]
    return charts(specs, len(figure.limits()) * figure.row_height + _HEADROOM, width)


# --- surfaces, as contours -------------------------------------------------------------------------------------------


def _surfaces(figure: Figure, surfaces: Sequence[tuple[str, Surface]], width: str) -> Sheet:
    """Return filled contours of one scale, side by side."""
    from matplotlib.ticker import MaxNLocator

    with laid_out(width, figure.row_height + _HEADROOM) as drawn:
        places = drawn.subplots(1, len(surfaces), sharex=True, sharey=True, squeeze=False)[0]
        levels = MaxNLocator(_LEVELS).tick_values(0.0, figure.brightest())
        for place, (title, surface) in zip(places, surfaces, strict=True):
            filled = place.contourf(surface.time, surface.frequency, surface.magnitude, levels, cmap="viridis")
            filled.set_edgecolor("face")  # no seams between the areas of a vector graphic
            filled.set_linewidth(0.2)
            place.plot(surface.time, surface.ridge, color="black", linewidth=0.8, label=surface.ridge_name)
            place.set(title=in_mathtext(title), xlabel="time [s]", xlim=figure.x_range)
            place.grid(visible=False)
        places[0].set_ylabel("frequency [Hz]")
        bar = drawn.colorbar(filled, ax=list(places), label=in_mathtext(surfaces[0][1].label), aspect=30)
        bar.locator = MaxNLocator(6)
        legend(drawn, places[0])
    return drawn


# --- maps ------------------------------------------------------------------------------------------------------------


def _maps(figure: MapFigure, width: str) -> Sheet:
    wide, columns = pictures.WIDTHS[width], len(figure.columns.values)
    height = min(_MOST, _FLAT * wide / columns)
    ticks = max(2, min(int((wide - _BESIDE) / columns / _TICK), TICKS))
    with laid_out(width, height * len(figure.rows) + _AROUND) as drawn:
        places = drawn.subplots(len(figure.rows), columns, sharex=True, sharey=True, squeeze=False)
        for (row, column), place in np.ndenumerate(places):
            shades = _draw_map(place, figure, figure.charts[row][column])
            place.set_xticks(*_ticks(figure.x, ticks))
            place.set_yticks(*_ticks(figure.y, TICKS))
            if column == 0:
                place.set_ylabel(figure.rows[row])
            if row == 0:
                place.set_title(written(figure.columns.values[column]))
        if figure.columns.label:
            drawn.suptitle(figure.columns.label, fontsize=7.5)
        drawn.supxlabel(figure.x.shown_label, fontsize=7.5)
        drawn.supylabel(figure.y.shown_label, fontsize=7.5)
        drawn.colorbar(shades, ax=places, label=figure.label, aspect=30)
    return drawn


def _draw_map(place: Axes, figure: MapFigure, chart: Chart) -> Any:
    """Return the colours, for their bar."""
    low, high = figure.limits
    shades = place.pcolormesh(
        figure.x.edges,
        figure.y.edges,
        np.ma.masked_invalid(chart.values),
        cmap="viridis" if figure.more_is_better else "viridis_r",
        vmin=low,
        vmax=high,
    )
    shades.set_edgecolor("face")
    place.grid(visible=False)
    if chart.line is not None:
        y = figure.y.position[list(chart.line.rows)]
        left, at, right = across(figure.x, chart.line)
        place.fill_betweenx(y, left, right, color=RED, alpha=0.3, linewidth=0.0)
        place.plot(at, y, "o-", color=RED, linewidth=1.4, markersize=2.0)
    return shades


def _ticks(scale: Scale, most: int) -> tuple[Array, list[str]]:
    shown = scale.ticks(most)
    return scale.position[shown], [written(scale.values[index]) for index in shown]
