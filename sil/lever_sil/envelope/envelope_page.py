"""envelope.html: the table, and of each condition the natural frequency in its worst run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from lever_cdkf.firmware.estimator import DO_NOT_TRUST, fault_names
from lever_cdkf.report.figure import Figure, axis, band, dots, line, time_axis
from lever_cdkf.report.page import Page

from ..acceptance import acceptance_page
from .measure import Excerpt
from .run_conditions import EnvelopeResult


def build(results: Sequence[EnvelopeResult], seeds: int) -> str:
    """Return the whole page."""
    page = Page(
        "The conditions that a collective meets",
        f"Levers and pilots by a plant that shares nothing with the filter's model, {seeds} random pilots a condition, "
        "the firmware as shipped. Charts: the natural frequency with its ±2σ, of each condition in the run in which it "
        "was worst.",
        "lever envelope",
    )
    charts = [None if result.excerpt is None else _chart(result.excerpt, result) for result in results]
    return acceptance_page.build(page, results, charts, f"Flagged is any of {', '.join(fault_names(DO_NOT_TRUST))}.")


def _chart(shown: Excerpt, result: EnvelopeResult) -> Figure:
    """Return natural frequency over time; dots at the foot where the firmware says: do not trust this."""
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
