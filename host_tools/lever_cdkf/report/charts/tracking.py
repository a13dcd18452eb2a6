"""What the project is about, the pilot's parameters, frequency and damping: estimated, true, and recorded before."""

from collections.abc import Sequence

import numpy as np

from ...firmware.quantities import DYNAMICS, Quantity, recorded_name
from ...numeric.arrays import Array
from ..figure import Figure, Spec, axis, axis_range, band, edges, hover, line, time_axis
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
    rows = [_row(run, each, [run.truth(each), run.estimate(each), *(_bounds(run, each) or ())]) for each in quantities]
    figure = Figure(rows, time_axis(run.end), height)
    for row, quantity in enumerate(quantities):
        figure.add(*_traces(run, quantity, row, chosen))
    figure.mark(run.changes)
    return figure


def _bounds(run: Run, quantity: Quantity) -> tuple[np.ndarray, np.ndarray] | None:
    estimate, sigma = run.estimate(quantity), run.sigma(quantity)
    return None if estimate is None or sigma is None else edges(estimate, sigma, quantity.least)


def recorded(run: Run) -> Figure | None:
    """Return every quantity of which a replayed log holds an estimate already, under that of the replay."""
    both = {each: (_recorded(run, each), run.estimate(each)) for each in run.quantities}
    both = {quantity: columns for quantity, columns in both.items() if columns[0] is not None}
    if not both:
        return None
    rows = [_row(run, quantity, columns) for quantity, columns in both.items()]
    figure = Figure(rows, time_axis(run.end), 60 + 140 * len(rows))
    chosen = spread_indices(len(run.time), POINTS)
    for row, columns in enumerate(both.values()):
        for values, name, colour, width in zip(
            columns, ("recorded", "replayed"), ("base", "estimate"), (3.0, 1.2), strict=True
        ):
            if values is not None:
                figure.add(line(run.time[chosen], values[chosen], name, colour, row, line_width=width))
    return figure


def _recorded(run: Run, quantity: Quantity) -> Array | None:
    return run.column(recorded_name(quantity.column("estimate")))


def _row(run: Run, quantity: Quantity, columns: Sequence[Array | None]) -> Spec:
    limits = axis_range([values for values in columns if values is not None], run.settled)
    return axis(f"{quantity.symbol} [{quantity.shown_unit}]", range=limits)


def _traces(run: Run, quantity: Quantity, row: int, chosen: np.ndarray) -> list[Spec]:
    time = run.time[chosen]
    traces: list[Spec] = []
    unit = "" if quantity.unit == "1" else quantity.shown_unit
    if bounds := _bounds(run, quantity):
        traces += band(time, bounds[0][chosen], bounds[1][chosen], "estimate ± 2σ", "estimate-band", row)
    if (truth := run.truth(quantity)) is not None:
        look: Spec = {"line_dash": "dash", "zorder": 1} | hover(f"true {quantity.name}", unit)
        traces.append(line(time, truth[chosen], "truth", "truth", row, **look))
    if (estimate := run.estimate(quantity)) is not None:
        look = hover(f"estimated {quantity.name}", unit)
        traces.append(line(time, estimate[chosen], "estimate", "estimate", row, **look))
        flagged = run.flagged[chosen]
        if flagged.any():  # drawn over the other; its label is that of the other
            flagged[1:] |= flagged[:-1]  # a single sample is a line to the next
            doubtful, style = np.where(flagged, estimate[chosen], np.nan), {"line_width": 2.4, "hoverinfo": "skip"}
            traces.append(line(time, doubtful, "estimate, flagged: do not trust", "quiet", row, **style))
    return traces
