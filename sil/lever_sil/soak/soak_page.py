"""soak.html: what each hour came to."""

from __future__ import annotations

import html
from typing import Any

import numpy as np
from lever_cdkf.cli.tables import Row
from lever_cdkf.report.figure import SERIES, Figure, axis, line
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import rows_table

from .soak import COUNTS, HOUR, QUANTITIES, SoakResult

_SEES = """\
<p>NEES is e' P<sup>-1</sup> e / 3 of the logarithms of the three parameters, of the time without a flag. Their errors
last for tens of seconds, and gains of sensors for a flight, so an hour holds some dozens of independent values, and
its NEES scatters accordingly. It sees errors that are larger than what is stated, and, below 1, standard deviations
that are too large. It does not see what is flagged; what is wrong for pilots and firmware alike (the plant here is
the filter's model: <code>lever envelope</code> has another); nor an hour in which some errors are too large and
others too small.</p>
"""


def build(result: SoakResult, rows: list[Row], verdict: str) -> str:
    """Return the whole page; `rows` are the hours, as printed."""
    page = Page(
        f"{_duration(result.total.seconds)} without a reset",
        "One instance of the firmware, hour by hour.",
        "lever soak",
    )
    page.section("hours", "Hours", "Consistency by the hour", page.figure("chart", _chart(result), ""), _SEES)
    page.section("table", "Table", "All figures", *map(rows_table, _in_two(rows)))
    return page.html(f'<p class="verdict {"bad" if result.troubles() else "good"}">{html.escape(verdict)}</p>')


def _in_two(rows: list[Row]) -> tuple[list[Row], list[Row]]:
    """Return consistency, and counts: both in one table are wider than a page."""
    hour, *names = rows[0]
    counts = names.index(COUNTS)
    return (
        [{name: row[name] for name in (hour, *names[:counts])} for row in rows],
        [{name: row[name] for name in (hour, *names[counts:])} for row in rows],
    )


def _duration(seconds: float) -> str:
    """Return a time in words."""
    if seconds < HOUR:
        return f"{seconds / 60.0:.0f} minutes"
    hours = seconds / HOUR
    return "A day" if hours == 24.0 else "An hour" if hours == 1.0 else f"{hours:.3g} hours"


def _chart(result: SoakResult) -> Figure:
    hours = np.arange(1.0, len(result.parts) + 1.0)
    rows = [part.sums.row() for part in result.parts]
    titles = ("NEES, NIS (expected 1)", "within 2σ [%]", "memory [MiB]")
    ticks = {"dtick": 1} if len(hours) <= 12 else {}
    x_axis = axis("hour", range=[0.5, hours[-1] + 0.5], **ticks)
    figure = Figure([axis(title) for title in titles], x_axis, height=620)
    figure.over_time = False
    curves: list[tuple[str, list[Any], int]] = [
        *((name, [row[f"{name} (expected 1)"] for row in rows], 0) for name in ("NEES", "NIS")),
        *((f"{each} within 2σ", [row[f"{each} within 2 sigma [%]"] for row in rows], 1) for each in QUANTITIES),
        ("memory", [part.memory for part in result.parts], 2),
    ]
    for (name, values, row), colour in zip(curves, SERIES, strict=False):  # marked, as an hour alone makes no line
        figure.add(line(hours, np.array(values), name, colour, row, mode="lines+markers"))
    figure.level(1.0)
    return figure
