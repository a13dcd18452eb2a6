"""Figures for print, on white, as wide as one or two columns of a paper: the renderer by matplotlib.

Charts are drawn from the JSON of plotly.js that a page shows. What a page shows otherwise than print, surfaces and
maps, is drawn from its description.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from lever_cdkf.exports import pictures
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.figure import Spec
from lever_cdkf.runtime.provenance import Provenance

from . import plotted
from .description import Figure, Surface
from .maps import RED, TICKS, Chart, MapFigure, Scale, across, written
from .typesetting import Colour, colours, in_mathtext

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

_HEADROOM = 0.55  # [inches] for legend, column titles and the label of the x axis
_POINTS_A_PIXEL = 0.6  # widths of lines and markers are told in pixels of the page
_DASHES = {"solid": "-", "dash": (0, (4, 1.8)), "dot": ":", "dashdot": "-."}
_SYMBOLS = {"circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "cross": "P", "star": "*"}
_LEGEND_COLUMNS = 4  # at most
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


@contextmanager
def _laid_out(width: str, height: float) -> Iterator[Sheet]:
    """Give an empty sheet, `height` in inches, and lay out what is drawn on it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    with pictures.style():
        drawn = Sheet((pictures.WIDTHS[width], height), pictures.RESOLUTION, layout="constrained")
        FigureCanvasAgg(drawn)
        yield drawn
        drawn.draw_without_rendering()
        drawn.set_layout_engine("none")  # each file would be laid out anew, and a little differently


# --- charts ----------------------------------------------------------------------------------------------------------


def charts(columns: Sequence[tuple[str, Spec]], height: float, width: str) -> Sheet:
    """Return figures of a page beside each other under their titles, `height` in inches; each has the same rows."""
    rows = [key for key in columns[0][1]["layout"] if key.startswith("yaxis")]
    with _laid_out(width, height) as drawn:
        places = drawn.subplots(len(rows), len(columns), sharex=True, sharey="row", squeeze=False)
        for (row, column), place in np.ndenumerate(places):
            _set_axes(place, columns[column][1]["layout"], rows[row])
            _draw(place, columns[column][1], rows[row].replace("axis", ""))
        for place, (title, _) in zip(places[0], columns, strict=True):
            place.set_title(in_mathtext(title))
        drawn.align_ylabels(places[:, 0])
        if columns[0][1]["layout"].get("showlegend", True):
            _legend(drawn, *places.ravel())
    return drawn


def values(packed: Mapping[str, Any]) -> Array:
    """Return what series.packed() has packed."""
    return np.frombuffer(base64.b64decode(packed["bdata"]), "<f4").astype(np.float64)


def _set_axes(place: Axes, layout: Spec, row: str) -> None:
    """Set up the axes of a chart, labels at the left and at the foot."""
    from matplotlib.ticker import LogFormatter, StrMethodFormatter

    x, y, cell = layout["xaxis"], layout[row], place.get_subplotspec()
    assert cell is not None
    if cell.is_last_row():
        place.set_xlabel(in_mathtext(x["title"]["text"]))
    if x.get("type") == "log":
        place.set_xscale("log")
        place.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        place.xaxis.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.5)))
    elif "range" in x:
        place.set_xlim(x["range"])
        place.locator_params(axis="x", nbins=5)
    if "ticktext" in y:
        place.set_yticks(y["tickvals"], [in_mathtext(name) for name in y["ticktext"]])
    else:
        place.locator_params(axis="y", nbins=max(4, round(2.5 * place.bbox.height / pictures.RESOLUTION)))
        if cell.is_first_col():
            place.set_ylabel(in_mathtext(y["title"]["text"]))
    if "range" in y:
        place.set_ylim(y["range"])


def _draw(place: Axes, spec: Spec, row: str) -> None:
    below: Array = np.zeros(0)  # the lower edge of a band
    for trace in spec["data"]:
        if trace["yaxis"] != row:
            continue
        x, y = values(trace["x"]), values(trace["y"])
        label = in_mathtext(trace["name"]) if trace.get("showlegend", True) else None
        if trace["mode"] == "markers":
            _mark(place, trace, x, y, label)
        elif "fill" in trace:
            place.fill_between(x, below, y, color=_colour(trace["fillcolor"]), linewidth=0.0, label=label)
        elif trace["line"]["width"]:
            look, width = trace["line"], _POINTS_A_PIXEL * trace["line"]["width"]
            dash = _DASHES[look.get("dash", "solid")]
            place.plot(x, y, color=_colour(look["color"]), linewidth=width, linestyle=dash, label=label)
        below = y
    for shape in spec["layout"]["shapes"]:
        draw, at = (place.axvline, shape["x0"]) if shape["x0"] == shape["x1"] else (place.axhline, shape["y0"])
        draw(at, color=_colour(shape["line"]["color"]), linewidth=0.8, linestyle=":")


def _mark(place: Axes, trace: Spec, x: Array, y: Array, label: str | None) -> None:
    """Draw a symbol at each point, or where the trace has none a small dot."""
    marker = trace["marker"]
    if "symbol" not in marker:
        look = {"markersize": _POINTS_A_PIXEL * marker["size"], "markeredgewidth": 0.0, "label": label}
        place.plot(x, y, ".", color=_colour(marker["color"]), **look)
        return
    symbol, size = marker["symbol"], (_POINTS_A_PIXEL * marker["size"]) ** 2
    shades: Any = marker["color"] if isinstance(marker["color"], list) else [marker["color"]] * len(x)
    edges = [_colour(shade) for shade in shades]
    if "error_x" in trace:
        widths = trace["error_x"]["array"]
        place.errorbar(x, y, xerr=widths, fmt="none", ecolor=_colour(trace["error_x"]["color"]), elinewidth=0.7)
    faces: Any = "none" if symbol.endswith("-open") else edges
    shape = _SYMBOLS[symbol.removesuffix("-open")]
    place.scatter(x, y, size, marker=shape, facecolors=faces, edgecolors=edges, linewidths=0.6, label=label, zorder=3)


def _colour(name: str) -> Colour:
    return colours()[name.removeprefix("@")]


def _legend(sheet: Sheet, *places: Axes) -> None:
    """Add one for all charts, above them; dots are larger there."""
    from matplotlib.collections import PathCollection

    named: dict[str, Any] = {}
    for place in places:
        handles, labels = place.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    sheet.legend(
        list(named.values()),
        list(named),
        loc="outside upper center",
        ncols=min(len(named), round(sheet.get_figwidth()), _LEGEND_COLUMNS),
        markerscale=1 if any(isinstance(handle, PathCollection) for handle in named.values()) else 4,
    )


# --- surfaces, as contours -------------------------------------------------------------------------------------------


def _surfaces(figure: Figure, surfaces: Sequence[tuple[str, Surface]], width: str) -> Sheet:
    """Return filled contours of one scale, side by side."""
    from matplotlib.ticker import MaxNLocator

    with _laid_out(width, figure.row_height + _HEADROOM) as drawn:
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
        _legend(drawn, places[0])
    return drawn


# --- maps ------------------------------------------------------------------------------------------------------------


def _maps(figure: MapFigure, width: str) -> Sheet:
    wide, columns = pictures.WIDTHS[width], len(figure.columns.values)
    height = min(_MOST, _FLAT * wide / columns)
    ticks = max(2, min(int((wide - _BESIDE) / columns / _TICK), TICKS))
    with _laid_out(width, height * len(figure.rows) + _AROUND) as drawn:
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
        drawn.supxlabel(figure.x.label, fontsize=7.5)
        drawn.supylabel(figure.y.label, fontsize=7.5)
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
