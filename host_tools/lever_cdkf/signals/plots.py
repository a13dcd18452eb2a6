"""Signals as small plots: lines of characters for a terminal; charts of a page, PNG, SVG and PDF."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..exports import pictures
from ..numeric.arrays import FloatArray
from ..report import printed
from ..report.figure import Figure, axis, line, time_axis
from ..report.page import Page
from ..report.series import envelope
from ..runtime.extras import require
from ..runtime.files import whole, write_text
from ..runtime.provenance import Provenance, with_provenance
from .recorded import Signal

_BLOCKS = "▁▂▃▄▅▆▇█"
_STRETCHES = 600
"""A chart shows the range of the values in each of so many stretches of time."""
_GAP = 10.0
"""Mean steps of time over which no line is drawn."""
_PIXELS, _INCHES = 120, 1.2
"""Height of a chart, in a page and in print."""
KINDS = (".html", *(f".{kind}" for kind in pictures.KINDS))


def sparkline(signal: Signal, width: int) -> str:
    """Return the means of `width` equal parts of its time, from least to greatest as eight heights.

    It is blank where there is no mean.
    """
    values = _means(signal, width)
    present = values[np.isfinite(values)]
    if not len(present):
        return " " * width
    low, span = float(present.min()), float(np.ptp(present)) or 1.0
    return "".join(_BLOCKS[min(int(8.0 * (each - low) / span), 7)] if math.isfinite(each) else " " for each in values)


def _means(signal: Signal, count: int) -> FloatArray:
    """Return the means of equal parts of its time; NaN where it has no value."""
    valid = np.isfinite(signal.values)
    time, values = signal.time[valid], signal.values[valid]
    if not len(time):
        return np.full(count, np.nan)
    ends = (float(signal.time[0]), max(float(signal.time[-1]), float(signal.time[0]) + 1e-9))
    counts = np.histogram(time, count, ends)[0]
    return np.histogram(time, count, ends, weights=values)[0] / np.where(counts, counts, np.nan)


def write(path: Path, signals: Sequence[tuple[str, Signal]], title: str, origin: Provenance) -> None:
    """Write a page (.html) or picture with each signal under its heading, which may be empty. Raise LeverError."""
    if path.suffix.lower() == ".html":
        write_text(path, with_provenance(_page(signals, title), origin))
        return
    require("study")
    sheet = printed.charts([("", _figure(signals, *_extent(signals)).spec())], 0.6 + _INCHES * len(signals), "double")
    content = pictures.render(sheet, path.suffix.lower().removeprefix("."), title, origin)
    with whole(path) as target:
        target.write_bytes(content)


def _page(signals: Sequence[tuple[str, Signal]], title: str) -> str:
    page = Page(title, "The range of the values of each signal, over time.", "lever map")
    extent = _extent(signals)
    inputs, others = ([each for each in signals if bool(each[0]) is headed] for headed in (True, False))
    for key, name, part in (("inputs", "Inputs", inputs), ("others", "Other signals", others)):
        if part:
            page.section(key, name, name, page.figure(f"figure-{key}", _figure(part, *extent), ""))
    return page.html("")


def _extent(signals: Sequence[tuple[str, Signal]]) -> tuple[float, float]:
    """Return first and last time of all of them [s]."""
    times = [float(time) for _, each in signals if len(each.time) for time in each.time[[0, -1]]]
    return min(times, default=0.0), max(times, default=1.0)


def _figure(signals: Sequence[tuple[str, Signal]], begin: float, end: float) -> Figure:
    """Return a row for each signal, over the time from `begin` to `end` [s], counted from `begin`."""
    figure = Figure(
        [axis(html.escape(each.unit)) for _, each in signals], time_axis(end - begin), 80 + _PIXELS * len(signals)
    )
    figure.more |= {"showlegend": False, "hovermode": "closest"}
    for row, (heading, signal) in enumerate(signals):
        time, values = envelope(signal.time - begin, signal.values, _STRETCHES)
        steps = np.diff(time)
        gaps = np.flatnonzero(steps > _GAP * steps.sum() / max(len(steps), 1)) + 1
        time, values = np.insert(time, gaps, time[gaps]), np.insert(values, gaps, np.nan)
        figure.add(line(time, values, html.escape(signal.name), "estimate", row, line_width=1.2))
        figure.name_row(row, f"{heading}: {signal.name}, {_extremes(signal)}".removeprefix(": "))
    return figure


def _extremes(signal: Signal) -> str:
    present = signal.values[np.isfinite(signal.values)]
    if not len(present):
        return "no value"
    return f"{present.min():.4g} to {present.max():.4g} {signal.unit}".rstrip()
