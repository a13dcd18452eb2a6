"""The figures of compare.html for print, and as tables."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from lever_cdkf.exports import pictures
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.figure import Spec
from lever_cdkf.runtime.provenance import Provenance

from ..figures.typesetting import Colour, colours, in_mathtext

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KINDS = ("pdf", "svg")
COLUMNS = ("series", "lane", "x", "y", "error")
"""Of a table: lane is the estimator where y is only a place."""

_PIXELS_AN_INCH = 110.0
_POINTS_A_PIXEL = 0.6
_SYMBOLS = {"square": "s", "diamond": "D", "triangle-up": "^", "cross": "P", "star": "*"}


def render(figure: Spec, name: str, kind: str, provenance: Provenance) -> bytes:
    """Return the file, two columns of a journal wide."""
    from matplotlib.figure import Figure as Sheet

    with pictures.style():
        sheet = Sheet(
            figsize=(pictures.WIDTHS["double"], figure["layout"]["height"] / _PIXELS_AN_INCH), layout="constrained"
        )
        axes = sheet.add_subplot()
        _lay_out(axes, figure)
        _draw(axes, figure)
        handles, labels = axes.get_legend_handles_labels()
        if labels and figure["layout"].get("showlegend", True):
            sheet.legend(handles, labels, loc="outside upper center", ncols=4)
    return pictures.render(sheet, kind, name, provenance)


def table(figure: Spec) -> str:
    """CSV, a row for each point."""
    lanes = figure["layout"]["yaxis"].get("ticktext", ())
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for trace in figure["data"]:
        errors = trace.get("error_x", {}).get("array", ())
        for index, (x, y) in enumerate(zip(_values(trace["x"]), _values(trace["y"]), strict=True)):
            if np.isfinite(x) and np.isfinite(y):
                lane = lanes[round(float(y))] if len(lanes) else ""
                error = f"{errors[index]:.7g}" if len(errors) and errors[index] else ""
                writer.writerow([trace["name"], lane, f"{x:.7g}", f"{y:.7g}", error])
    return text.getvalue()


def _lay_out(axes: Axes, figure: Spec) -> None:
    from matplotlib.ticker import LogFormatter, StrMethodFormatter

    rows, across = figure["layout"]["yaxis"], figure["layout"]["xaxis"]
    axes.set_xlabel(in_mathtext(across["title"]["text"]))
    if across.get("type") == "log":
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.5)))
    if "ticktext" in rows:
        axes.set_yticks(rows["tickvals"], [in_mathtext(name) for name in rows["ticktext"]])
    else:
        axes.set_ylabel(in_mathtext(rows["title"]["text"]))
    if "range" in rows:
        axes.set_ylim(*rows["range"])


def _draw(axes: Axes, figure: Spec) -> None:
    below: Array = np.zeros(0)  # the lower edge of a band
    for trace in figure["data"]:
        x, y = _values(trace["x"]), _values(trace["y"])
        label = in_mathtext(trace["name"]) if trace.get("showlegend", True) else None
        if trace["mode"] == "markers":
            _mark(axes, trace, x, y, label)
        elif "fill" in trace:
            axes.fill_between(x, below, y, color=_colour(trace["fillcolor"]), linewidth=0.0, label=label)
        elif trace["line"]["width"]:
            axes.plot(x, y, color=_colour(trace["line"]["color"]), linewidth=1.0, label=label)
        below = y
    for shape in figure["layout"]["shapes"]:
        draw, at = (axes.axvline, shape["x0"]) if shape["x0"] == shape["x1"] else (axes.axhline, shape["y0"])
        draw(at, color=_colour(shape["line"]["color"]), linewidth=0.8, linestyle=":")


def _mark(axes: Axes, trace: Spec, x: Array, y: Array, label: str | None) -> None:
    marker = trace["marker"]
    symbol, size = marker.get("symbol", "circle"), (_POINTS_A_PIXEL * marker["size"]) ** 2
    shades: Any = marker["color"] if isinstance(marker["color"], list) else [marker["color"]] * len(x)
    edges = [_colour(shade) for shade in shades]
    faces: Any = "none" if symbol.endswith("-open") else edges
    shape = _SYMBOLS.get(symbol.removesuffix("-open"), "o")
    axes.scatter(x, y, size, marker=shape, facecolors=faces, edgecolors=edges, linewidths=0.6, label=label, zorder=3)
    if "error_x" in trace:
        widths = trace["error_x"]["array"]
        axes.errorbar(x, y, xerr=widths, fmt="none", ecolor=_colour(trace["error_x"]["color"]), elinewidth=0.7)


def _values(packed: Mapping[str, Any]) -> Array:
    """Return what series.packed() has packed."""
    return np.frombuffer(base64.b64decode(packed["bdata"]), "<f4").astype(np.float64)


def _colour(name: str) -> Colour:
    return colours()[name.removeprefix("@")]


def files(figures: Mapping[str, Spec], provenance: Provenance) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each."""
    for name, figure in figures.items():
        for kind in KINDS:
            yield f"{name}.{kind}", render(figure, name, kind, provenance)
        yield f"{name}.csv", table(figure).encode()
