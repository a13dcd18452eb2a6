"""envelope.html: the table, and of each condition the natural frequency in its worst run."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np
from lever_cdkf.host_tools.report.figure import Figure, axis, band, dots, line, time_axis
from lever_cdkf.host_tools.report.page import Page
from lever_cdkf.host_tools.report.summary_html import table
from lever_cdkf.host_tools.tables import Row

from .campaign import Result
from .measure import FIGURES, FLAGS, Excerpt
from .table import MISSED, figures, lines, state

_STYLE = """
.missed { color: var(--bad); }
#table :is(td, th):nth-child(3) { text-align: left; white-space: normal; }
@media (min-width: 1100px) {
  :root:not(.paper) .condition { display: grid; grid-template-columns: minmax(0, 1fr) auto; gap: 2rem; }
}
"""


def build(results: Sequence[Result], seeds: int) -> str:
    """The whole page."""
    page = Page(
        "The conditions that a collective meets",
        f"Levers and pilots by a plant that shares nothing with the filter's model, {seeds} random pilots a condition, "
        "the firmware as shipped. Charts: the natural frequency with its ±2σ, of each condition in the run in which it "
        "was worst.",
        "lever envelope",
    )
    page.section("table", "Table", "Measured values against their limits", _table(lines(results)), _legend(results))
    for result in results:
        name, chart = result.condition.name, None if result.excerpt is None else _chart(result.excerpt, result)
        title = f"{html.escape(result.condition.title)}: {state(result)}"
        parts = page.figure(f"chart-{name}", chart, ""), _table(figures(result))
        page.section(name, name, title, f'<div class="condition">{"".join(parts)}</div>')
    return page.html(_verdict(results), _STYLE)


def _verdict(results: Sequence[Result]) -> str:
    judged = [result for result in results if result.condition.limits]
    missed = [f'<a href="#{each.condition.name}">{each.condition.name}</a>' for each in judged if not each.ok]
    return (
        f'<p class="verdict {"bad" if missed else "good"}">{len(judged) - len(missed)} of {len(judged)} conditions '
        f"hold.{' Missed: ' + ', '.join(missed) + '.' if missed else ''}</p>"
    )


def _table(rows: Sequence[Row]) -> str:
    return table([html.escape(column) for column in rows[0]], (_cells(row) for row in rows))


def _cells(row: Row) -> list[str]:
    """As HTML; a condition links to its section."""
    cells = {column: html.escape(str(cell)) for column, cell in row.items()}
    if cells.get("condition"):
        cells["condition"] = f'<a href="#{cells["condition"]}">{cells["condition"]}</a>'
    if cells.get("result") == MISSED:
        cells["result"] = f'<strong class="missed">{MISSED}</strong>'
    return list(cells.values())


def _legend(results: Sequence[Result]) -> str:
    used = dict.fromkeys(name for result in results for name in result.condition.figures)
    rows = ([html.escape(name), html.escape(FIGURES[name].unit), html.escape(FIGURES[name].meaning)] for name in used)
    return (
        f"<details><summary>What the figures mean</summary>{table(('', 'unit', 'meaning'), rows)}"
        f"<p>Flagged is any of {', '.join(FLAGS)}.</p></details>"
    )


def _chart(shown: Excerpt, result: Result) -> Figure:
    """Natural frequency over time; dots at the foot where the firmware says: do not trust this."""
    low, high = shown.value - 2.0 * shown.sigma, shown.value + 2.0 * shown.sigma
    values = np.concatenate((shown.truth[shown.truth > 2.0], shown.value))
    values = values[np.isfinite(values)] if np.isfinite(values).any() else np.ones(1)
    floor, ceiling = 0.85 * float(np.percentile(values, 1.0)), 1.15 * float(np.percentile(values, 99.0))
    figure = Figure([axis("natural frequency [Hz]", range=[floor, ceiling])], time_axis(shown.time[-1]), height=260)
    figure.add(*band(shown.time, low, high, "estimate ±2σ", "estimate-band"))
    if shown.truth.size:
        figure.add(line(shown.time, shown.truth, "truth", "truth", line_dash="dash", zorder=1))
    figure.add(line(shown.time, shown.value, "estimate", "estimate"))
    if shown.flagged.any():
        at = shown.time[shown.flagged]
        figure.add(dots(at, np.full(at.shape, floor + 0.02 * (ceiling - floor)), "flagged", "fault"))
    figure.mark([moment for event in result.condition.events for moment in event])
    return figure
