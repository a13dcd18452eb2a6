"""soak.html: what each hour came to."""

from __future__ import annotations

import html

import numpy as np
from lever_cdkf.cli.tables import Row
from lever_cdkf.report.figure import SERIES, Figure, axis, line
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import rows_table

from .soak import QUANTITIES, SoakResult

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
    page = Page("A day without a reset", "One instance of the firmware, hour by hour.", "lever soak")
    page.section("hours", "Hours", "Consistency by the hour", page.figure("chart", _chart(result), ""), _SEES)
    page.section("table", "Table", "All figures", rows_table(rows))
    return page.html(f'<p class="verdict {"bad" if result.troubles() else "good"}">{html.escape(verdict)}</p>')


def _chart(result: SoakResult) -> Figure:
    hours = np.arange(1.0, len(result.parts) + 1.0)
    rows = [part.sums.row() for part in result.parts]
    titles = ("NEES, NIS (expected 1)", "within 2σ [%]", "memory [MiB]")
    figure = Figure([axis(title) for title in titles], axis("hour", range=[0.5, hours[-1] + 0.5]), height=620)
    figure.over_time = False
    for name, colour in (("NEES", SERIES[0]), ("NIS", SERIES[1])):
        figure.add(line(hours, np.array([row[f"{name} (expected 1)"] for row in rows]), name, colour))
    for quantity, colour in zip(QUANTITIES, SERIES, strict=False):
        held = np.array([row[f"{quantity} within 2 sigma [%]"] for row in rows])
        figure.add(line(hours, held, f"{quantity} within 2σ", colour, row=1))
    figure.add(line(hours, np.array([part.memory for part in result.parts]), "memory", SERIES[3], row=2))
    figure.level(1.0)
    return figure
