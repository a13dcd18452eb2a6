"""Truth and estimate of what the project is about: the pilot's parameters, natural frequency and damping ratio."""

import numpy as np

from ...firmware.quantities import DYNAMICS, Quantity
from ..figure import Figure, Spec, axis, axis_range, band, line, time_axis
from ..run import Run
from ..series import spread_indices

POINTS = 1500


def parameters(run: Run) -> Figure | None:
    """Return those of the estimator's model over time."""
    return _tracked(run, run.parameters, height=580)


def dynamics(run: Run) -> Figure | None:
    """Return natural frequency and damping ratio over time."""
    return _tracked(run, DYNAMICS, height=420)


def _tracked(run: Run, quantities: tuple[Quantity, ...], height: int) -> Figure | None:
    if any(run.estimate(quantity) is None for quantity in quantities):
        return None
    moments = np.searchsorted(run.time, run.changes)
    chosen = spread_indices(len(run.time), POINTS, moments)
    figure = Figure([_row(run, quantity) for quantity in quantities], time_axis(run.end), height)
    for row, quantity in enumerate(quantities):
        figure.add(*_traces(run, quantity, row, chosen))
    figure.mark(run.changes)
    return figure


def _bounds(run: Run, quantity: Quantity) -> tuple[np.ndarray, np.ndarray] | None:
    estimate, sigma = run.estimate(quantity), run.sigma(quantity)
    if estimate is None or sigma is None:
        return None
    lower = estimate - 2.0 * sigma
    return lower if quantity.signed else np.maximum(lower, 0.0), estimate + 2.0 * sigma


def _row(run: Run, quantity: Quantity) -> Spec:
    shown = [values for values in (run.truth(quantity), run.estimate(quantity)) if values is not None]
    limits = axis_range([*shown, *(_bounds(run, quantity) or ())], run.settled)
    return axis(f"{quantity.symbol} [{quantity.shown_unit}]", range=limits)


def _traces(run: Run, quantity: Quantity, row: int, chosen: np.ndarray) -> list[Spec]:
    time = run.time[chosen]
    traces: list[Spec] = []
    unit = "" if quantity.unit == "1" else f" {quantity.shown_unit}"
    if bounds := _bounds(run, quantity):
        traces += band(time, bounds[0][chosen], bounds[1][chosen], "estimate ± 2σ", "estimate-band", row)
    if (truth := run.truth(quantity)) is not None:
        hover = f"true {quantity.name} %{{y:.4g}}{unit}<extra></extra>"
        traces.append(line(time, truth[chosen], "truth", "truth", row, line_dash="dash", zorder=1, hovertemplate=hover))
    if (estimate := run.estimate(quantity)) is not None:
        hover = f"estimated {quantity.name} %{{y:.4g}}{unit}<extra></extra>"
        traces.append(line(time, estimate[chosen], "estimate", "estimate", row, hovertemplate=hover))
        flagged = run.flagged[chosen]
        if flagged.any():  # drawn over the other; its label is that of the other
            flagged[1:] |= flagged[:-1]  # a single sample is a line to the next
            doubtful, style = np.where(flagged, estimate[chosen], np.nan), {"line_width": 2.4, "hoverinfo": "skip"}
            traces.append(line(time, doubtful, "estimate, flagged: do not trust", "quiet", row, **style))
    return traces
