"""Figures of a page for print, on white: drawn by matplotlib from the JSON of plotly.js that the page shows."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ..exports import pictures
from ..numeric.arrays import Array
from .figure import Spec
from .typesetting import Colour, colours, in_mathtext

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

_POINTS_A_PIXEL = 0.6  # widths of lines and markers are told in pixels of the page
_DASHES = {"solid": "-", "dash": (0, (4, 1.8)), "dot": ":", "dashdot": "-."}
_SYMBOLS = {"circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "cross": "P", "star": "*"}
_LEGEND_COLUMNS = 4  # at most
_ALIGNED = 12  # labels of y axes at most: the time that it takes grows with their square


@contextmanager
def laid_out(width: str, height: float) -> Iterator[Sheet]:
    """Give an empty sheet, `height` in inches, and lay out what is drawn on it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    with pictures.style():
        drawn = Sheet((pictures.WIDTHS[width], height), pictures.RESOLUTION, layout="constrained")
        FigureCanvasAgg(drawn)
        yield drawn
        drawn.draw_without_rendering()
        drawn.set_layout_engine("none")  # each file would be laid out anew, and a little differently


def charts(columns: Sequence[tuple[str, Spec]], height: float, width: str) -> Sheet:
    """Return figures of a page beside each other under their titles, `height` in inches; each has the same rows."""
    rows = [key for key in columns[0][1]["layout"] if key.startswith("yaxis")]
    with laid_out(width, height) as drawn:
        places = drawn.subplots(len(rows), len(columns), sharex=True, sharey="row", squeeze=False)
        for (row, column), place in np.ndenumerate(places):
            _set_axes(place, columns[column][1]["layout"], rows[row])
            _draw(place, columns[column][1], rows[row].replace("axis", ""))
        for place, (title, _) in zip(places[0], columns, strict=True):
            place.set_title(in_mathtext(title))
        if len(rows) <= _ALIGNED:
            drawn.align_ylabels(places[:, 0])
        if columns[0][1]["layout"].get("showlegend", True):
            legend(drawn, *places.ravel())
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
    for note in spec["layout"]["annotations"]:
        if note.get("yref") == f"{row} domain":
            place.set_title(html.unescape(note["text"]), loc="left", parse_math=False)
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


def legend(sheet: Sheet, *places: Axes) -> None:
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
