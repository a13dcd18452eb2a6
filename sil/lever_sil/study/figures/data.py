"""What a figure shows, as numbers: a table of text."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence

import numpy as np

from .description import Band, Figure, Surface, Trace
from .maps import Line, MapFigure

COLUMNS = ("column", "chart", "series", "time_s", "frequency_Hz", "value", "low", "high")
"""Of the table: titles of column and chart, name of the curve; of a band low and high, of a surface the frequency."""


def table(figure: Figure | MapFigure) -> str:
    """CSV, a row for each point."""
    if isinstance(figure, MapFigure):
        return _map_table(figure)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for column in figure.columns:
        if isinstance(column.content, Surface):
            writer.writerows([column.title, *row] for row in _surface(column.content))
            continue
        for chart in column.content:
            for trace in chart.traces:
                writer.writerows([column.title, chart.label, trace.name, *row] for row in _points(trace))
    return text.getvalue()


def _points(trace: Trace) -> Iterator[list[str]]:
    nothing = np.full(len(trace.x), np.nan)
    edges = (nothing, trace.low, trace.high) if isinstance(trace, Band) else (trace.y, nothing, nothing)
    for time, *values in zip(trace.x, *edges, strict=True):
        yield [_number(time), "", *map(_number, values)]


def _surface(surface: Surface) -> Iterator[list[str]]:
    for place, frequency in enumerate(surface.frequency):
        for time, magnitude in zip(surface.time, surface.magnitude[place], strict=True):
            yield [surface.label, "", _number(time), _number(frequency), _number(magnitude), "", ""]
    for time, frequency, magnitude in zip(surface.time, surface.ridge, surface.ridge_magnitude, strict=True):
        yield [surface.label, surface.ridge_name, _number(time), _number(frequency), _number(magnitude), "", ""]


def _number(value: float) -> str:
    """Seven digits, as many as single precision has; nothing for NaN."""
    return f"{value:.7g}" if np.isfinite(value) else ""


def _map_table(figure: MapFigure) -> str:
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
