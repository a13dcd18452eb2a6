"""envelope.html: the table, and of each condition the natural frequency in its worst run."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np

from ..report.document import document
from ..report.figure import Figure, axis, band, dots, line, time_axis
from ..report.page import Page
from ..report.words import table
from .campaign import Result
from .measure import FIGURES, FLAGS, Excerpt
from .table import lines, state

_TITLE = "Lever CDKF: what a collective meets every minute"


def build(results: Sequence[Result], seeds: int) -> str:
    """The whole page."""
    page = Page()
    page.section("table", "Table", "Measured against what must hold", _table(results), _legend(results))
    for result in results:
        if result.excerpt is not None:
            page.section(
                result.condition.name,
                result.condition.name,
                f"{html.escape(result.condition.title)}: {state(result)}",
                page.figure(f"chart-{result.condition.name}", _chart(result.excerpt, result), ""),
            )
    judged = [result for result in results if result.condition.limits]
    kept = sum(result.ok for result in judged)
    mood = "good" if kept == len(judged) else "bad"
    missed = [f'<a href="#{result.condition.name}">{result.condition.name}</a>' for result in judged if not result.ok]
    body = (
        f'<header><h1>{_TITLE}</h1><p class="subtitle">Levers and pilots by a plant that shares nothing with the '
        f"filter's model, {seeds} random pilots a condition, the firmware as shipped. Charts: the natural frequency "
        "with its ±2σ, of each condition in the run in which it was worst.</p></header>"
        f'<p class="verdict {mood}">{kept} of {len(judged)} conditions hold.'
        f"{' Missed: ' + ', '.join(missed) + '.' if missed else ''}</p>{''.join(page.sections)}"
        "<footer>Made by <code>lever envelope</code>. Nothing on this page is loaded from elsewhere.</footer>"
    )
    return document(_TITLE, body, {key: figure.spec() for key, figure in page.figures.items()})


def _table(results: Sequence[Result]) -> str:
    rows = lines(results)
    cells = ([html.escape(str(cell)) for cell in row.values()] for row in rows)
    return table([html.escape(column) for column in rows[0]] if rows else (), cells)


def _legend(results: Sequence[Result]) -> str:
    used = dict.fromkeys(name for result in results for name in result.condition.figures)
    meanings = "; ".join(f"<strong>{html.escape(name)}</strong> {html.escape(FIGURES[name].meaning)}" for name in used)
    return f"<p>{meanings}. Flagged is any of {', '.join(FLAGS)}.</p>"


def _chart(shown: Excerpt, result: Result) -> Figure:
    """Natural frequency over time; dots at the foot where the firmware says: do not trust this."""
    low, high = shown.value - 2.0 * shown.sigma, shown.value + 2.0 * shown.sigma
    known = np.concatenate((shown.truth[shown.truth > 2.0], shown.value))
    floor, ceiling = 0.85 * float(np.percentile(known, 1.0)), 1.15 * float(np.percentile(known, 99.0))
    figure = Figure([axis("natural frequency [Hz]", range=[floor, ceiling])], time_axis(shown.time[-1]), height=260)
    figure.add(*band(shown.time, low, high, "estimate ±2σ", "estimate-band"))
    if shown.truth.size:
        figure.add(line(shown.time, shown.truth, "truth", "truth"))
    figure.add(line(shown.time, shown.value, "estimate", "estimate"))
    if shown.flagged.any():
        at = shown.time[shown.flagged]
        figure.add(dots(at, np.full(at.shape, floor + 0.02 * (ceiling - floor)), "flagged", "fault"))
    figure.mark([moment for event in result.condition.events for moment in event])
    return figure
