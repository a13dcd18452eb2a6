"""A page of conditions: the table, and a section with a chart and all figures of each."""

from __future__ import annotations

import html
from collections.abc import Sequence

from lever_cdkf.cli.tables import Row
from lever_cdkf.report.figure import Figure
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import table

from .result import ConditionResult
from .table import MISSED, figures, lines, state

_STYLE = """
.missed { color: var(--bad); }
#table :is(td, th):nth-child(3) { text-align: left; white-space: normal; }
@media (min-width: 1100px) {
  :root:not(.paper) .condition { display: grid; grid-template-columns: minmax(0, 1fr) auto; gap: 2rem; }
}
"""


def build(page: Page, results: Sequence[ConditionResult], charts: Sequence[Figure | None], note: str) -> str:
    """Return the whole page, with a chart for each result; `note` explains the figures."""
    page.section(
        "table", "Table", "Measured values against their limits", _table(lines(results)), _legend(results, note)
    )
    for result, chart in zip(results, charts, strict=True):
        name, title = result.condition.name, f"{html.escape(result.condition.title)}: {state(result)}"
        parts = page.figure(f"chart-{name}", chart, ""), _table(figures(result))
        page.section(name, name, title, f'<div class="condition">{"".join(parts)}</div>')
    return page.html(_verdict(results), _STYLE)


def _verdict(results: Sequence[ConditionResult]) -> str:
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


def _legend(results: Sequence[ConditionResult], note: str) -> str:
    used = {name: result.known[name] for result in results for name in result.condition.figures}
    rows = ([html.escape(name), html.escape(each.unit), html.escape(each.meaning)] for name, each in used.items())
    return (
        f"<details><summary>What the figures mean</summary>{table(('', 'unit', 'meaning'), rows)}"
        f"<p>{html.escape(note)}</p></details>"
    )
