"""A figure for print, on white, as wide as one or two columns of a paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lever_cdkf.exports import pictures
from lever_cdkf.runtime.provenance import Provenance

from . import maps
from .description import LOOKS, Band, Column, Figure, Points, Surface, Trace
from .maps import MapFigure
from .typesetting import colours, in_mathtext

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Sheet

_HEADROOM = 0.55  # [inches] for legend, column titles and the label of the x axis
_POINTS_A_PIXEL = 0.6  # line widths are told in pixels of the page
_DASHES = {"solid": "-", "dash": (0, (4, 1.8)), "dot": ":", "dashdot": "-."}
_LEVELS = 18  # of a contour, at most


def render(
    figure: Figure | MapFigure, kind: str = "png", width: str = "single", provenance: Provenance | None = None
) -> bytes:
    """Return the file, of pictures.KINDS, in one of pictures.WIDTHS; the same figure gives the same bytes."""
    return pictures.render(sheet(figure, width), kind, figure.title, provenance)


def sheet(figure: Figure | MapFigure, width: str = "single") -> Sheet:
    """Return the figure laid out by matplotlib."""
    if isinstance(figure, MapFigure):
        return maps.sheet(figure, width)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet

    with pictures.style():
        drawn = Sheet(dpi=pictures.RESOLUTION, layout="constrained")
        FigureCanvasAgg(drawn)
        drawn.set_figwidth(pictures.WIDTHS[width])
        surfaces = [(column.title, column.content) for column in figure.columns if isinstance(column.content, Surface)]
        if surfaces:
            _draw_surfaces(drawn, figure, surfaces)
        else:
            _draw_rows(drawn, figure)
        drawn.draw_without_rendering()
        drawn.set_layout_engine("none")  # each file would be laid out anew, and a little differently
    return drawn


def _draw_surfaces(sheet: Sheet, figure: Figure, surfaces: list[tuple[str, Surface]]) -> None:
    """Draw filled contours of one scale, side by side."""
    from matplotlib.ticker import MaxNLocator

    sheet.set_figheight(figure.row_height + _HEADROOM)
    charts = sheet.subplots(1, len(surfaces), sharex=True, sharey=True, squeeze=False)[0]
    levels = MaxNLocator(_LEVELS).tick_values(0.0, figure.brightest())
    for chart, (title, surface) in zip(charts, surfaces, strict=True):
        filled = chart.contourf(surface.time, surface.frequency, surface.magnitude, levels, cmap="viridis")
        filled.set_edgecolor("face")  # no seams between the areas of a vector graphic
        filled.set_linewidth(0.2)
        chart.plot(surface.time, surface.ridge, color="black", linewidth=0.8, label=surface.ridge_name)
        chart.set(title=in_mathtext(title), xlabel="time [s]", xlim=figure.x_range)
        chart.grid(visible=False)
    charts[0].set_ylabel("frequency [Hz]")
    bar = sheet.colorbar(filled, ax=list(charts), label=in_mathtext(surfaces[0][1].label), aspect=30)
    bar.locator = MaxNLocator(6)
    _legend(sheet, charts[0])


def _draw_rows(sheet: Sheet, figure: Figure) -> None:
    """Charts above each other, in each column."""
    limits = figure.limits()
    sheet.set_figheight(len(limits) * figure.row_height + _HEADROOM)
    charts = sheet.subplots(len(limits), len(figure.columns), sharex=True, sharey="row", squeeze=False)
    for index, column in enumerate(figure.columns):
        _draw_column(charts[:, index], column, figure)
    for chart, limit in zip(charts[:, 0], limits, strict=True):
        chart.set_ylim(limit)
    sheet.align_ylabels(charts[:, 0])
    _legend(sheet, *charts.ravel())


def _draw_column(charts: Any, column: Column, figure: Figure) -> None:
    assert not isinstance(column.content, Surface)
    for chart, row in zip(charts, column.content, strict=True):
        for trace in row.traces:
            _draw(chart, trace)
        for moment in figure.marks:
            chart.axvline(moment, color=colours()["mark"], linewidth=0.8, linestyle=":")
        if chart.get_subplotspec().is_first_col():
            chart.set_ylabel(in_mathtext(row.label))
        chart.set_xlim(figure.x_range)
        chart.locator_params(axis="x", nbins=5)
        chart.locator_params(axis="y", nbins=4)
    charts[0].set_title(in_mathtext(column.title))
    charts[-1].set_xlabel("time [s]")


def _draw(chart: Axes, trace: Trace) -> None:
    look = LOOKS[trace.look]
    colour, label, width = colours()[look.colour], in_mathtext(trace.name), _POINTS_A_PIXEL * look.width
    if isinstance(trace, Points):
        chart.plot(trace.x, trace.y, ".", color=colour, markersize=1.6, markeredgewidth=0.0, label=label)
    elif isinstance(trace, Band) and trace.filled:
        chart.fill_between(trace.x, trace.low, trace.high, color=colour, linewidth=0.0, label=label)
    elif isinstance(trace, Band):
        for edge, name in ((trace.low, label), (trace.high, None)):
            chart.plot(trace.x, edge, color=colour, linewidth=width, linestyle=_DASHES[look.dash], label=name)
    else:
        chart.plot(trace.x, trace.y, color=colour, linewidth=width, linestyle=_DASHES[look.dash], label=label)


def _legend(sheet: Sheet, *charts: Axes) -> None:
    """One for all charts, above them."""
    named: dict[str, Any] = {}
    for chart in charts:
        handles, labels = chart.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    sheet.legend(
        list(named.values()),
        list(named),
        loc="outside upper center",
        ncols=min(len(named), round(sheet.get_figwidth())),
        markerscale=4,
    )
