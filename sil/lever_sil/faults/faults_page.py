"""faults.html: the table, and of each fault that is not met as demanded the flight in which it was worst."""

from __future__ import annotations

import html
from collections.abc import Sequence

from lever_cdkf.firmware.estimator import DO_NOT_TRUST, fault_names
from lever_cdkf.report.page import Page
from lever_cdkf.report.summary_html import table
from lever_cdkf.text.counts import counted

from ..measures import WRONG
from .judge import BACK, ERROR, RIGHT, SILENT
from .matrix import RowResult
from .rows import KNOWN
from .table import HOLDS, demands, lines, missed, state, unexpected

_FEW = 12
"""Of so few faults all have a chart."""
_STYLE = """
.missed { color: var(--bad); }
#table :is(td, th):nth-child(-n+4) { text-align: left; white-space: normal; }
#table :is(td, th) { vertical-align: top; }
#table td:nth-child(n+2):nth-child(-n+4) { min-width: 10rem; }
"""


def build(results: Sequence[RowResult], seeds: int) -> str:
    """Return the whole page."""
    page = Page(
        "Faults of bus, senders and sensors",
        f"{counted(seeds, 'random pilot')} a fault, the worst of them. The fault lasts from 15 to 25 s "
        "of 40 s; frames pass the firmware's E2E check, and its dither moves the lever.",
        "lever faults",
    )
    page.section("table", "Table", "Faults and what the firmware must do", _table(results), _legend())
    for result in results:
        if result.broken or len(results) <= _FEW:
            _section(page, result)
    return page.html(_verdict(results), _STYLE)


def _verdict(results: Sequence[RowResult]) -> str:
    broken = [result.row.name for result in results if result.broken]
    links = ", ".join(f'<a href="#{name}">{name}</a>' for name in broken)
    silent = sum(result.silent for result in results)
    met = f"{len(results) - len(broken)} of {len(results)} faults are met as demanded"
    wrong = f"in {silent} an estimate is wrong for {SILENT:g} s or more without a flag"
    named = f" Not met: {links}." if broken else ""
    mood = "bad" if unexpected(results) else "watch" if broken else "good"
    return f'<p class="verdict {mood}">{met}; {wrong}.{named}</p>'


def _table(results: Sequence[RowResult]) -> str:
    header = (
        "fault",
        "",
        "must",
        "result",
        "to flag<br>[samples]",
        "back<br>[s]",
        "error after<br>[%]",
        "silent<br>[s]",
        "right<br>[%]",
    )
    return table(header, (_cells(result) for result in results))


def _cells(result: RowResult) -> list[str]:
    (row,) = lines([result])
    word = state(result)
    name = html.escape(result.row.name)
    if word != HOLDS:
        name, word = f'<a href="#{name}">{name}</a>', f'<strong class="missed">{word}</strong>: {missed(result)}'
    figures = ("to flag [samples]", "back [s]", "error after [%]", "silent [s]", "right [%]")
    shown = ["never" if row[column] is None else str(row[column]) for column in figures]
    return [name, html.escape(result.row.title), html.escape(demands(result.row.requirement)), word, *shown]


def _section(page: Page, result: RowResult) -> None:
    """Why it is not met, and a chart."""
    name, shown = result.row.name, result.shown.excerpt
    why = f"<p>Known: {html.escape(KNOWN[name])}.</p>" if result.broken and name in KNOWN else ""
    chart = page.figure(f"chart-{name}", None if shown is None else shown.chart(WRONG, result.row.time), "")
    page.section(name, name, f"{html.escape(result.row.title)}: {state(result)}", why, chart)


def _legend() -> str:
    return " ".join((
        f"<p>Of every fault, besides: estimates are finite; none is off by more than {WRONG:g}σ for {SILENT:g} s",
        f"without a flag, and {RIGHT:g} % of the samples without a flag are within {WRONG:g}σ; each sample is",
        f"answered; torque keeps its limits; the firmware learns again {BACK:g} s after the fault and knows the",
        f"natural frequency to {ERROR:g} % in the last 5 s. Flagged is any of {', '.join(fault_names(DO_NOT_TRUST))},",
        "a mode without estimates, and silence.</p>",
    ))  # fmt: skip
