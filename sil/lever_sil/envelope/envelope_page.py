"""envelope.html: the table, and of each condition the natural frequency in its worst run."""

from __future__ import annotations

from collections.abc import Sequence

from lever_cdkf.firmware.estimator import DO_NOT_TRUST, fault_names
from lever_cdkf.report.page import Page
from lever_cdkf.text.counts import counted

from ..acceptance import acceptance_page
from .run_conditions import EnvelopeResult


def build(results: Sequence[EnvelopeResult], seeds: int) -> str:
    """Return the whole page."""
    page = Page(
        "The conditions that a collective meets",
        "Levers and pilots by a plant that shares nothing with the filter's model, "
        f"{counted(seeds, 'random pilot')} a condition, "
        "the firmware as shipped. Charts: the natural frequency with its ±2σ, of each condition in the run in which it "
        "was worst.",
        "lever envelope",
    )
    charts = [None if result.excerpt is None else result.excerpt.chart(2.0, _moments(result)) for result in results]
    return acceptance_page.build(page, results, charts, f"Flagged is any of {', '.join(fault_names(DO_NOT_TRUST))}.")


def _moments(result: EnvelopeResult) -> list[float]:
    """Return where events begin and end [s]."""
    return [moment for event in result.condition.events for moment in event]
