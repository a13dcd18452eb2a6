"""Estimates that a replayed log holds already, under those of the replay."""

from ...firmware.quantities import Quantity, recorded_name
from ..figure import Figure, Spec, axis, axis_range, line, time_axis
from ..run import Run
from ..series import spread_indices

POINTS = 1500


def recorded(run: Run) -> Figure | None:
    """Return every quantity of which the log has an estimate."""
    compared = [quantity for quantity in run.quantities if run.column(_recorded(quantity)) is not None]
    if not compared:
        return None
    figure = Figure([_row(run, quantity) for quantity in compared], time_axis(run.end), 60 + 140 * len(compared))
    chosen = spread_indices(len(run.time), POINTS)
    for row, quantity in enumerate(compared):
        for name, column, colour, width in (
            ("recorded", _recorded(quantity), "base", 3.0),
            ("replayed", quantity.column("estimate"), "estimate", 1.2),
        ):
            values = run.column(column)
            if values is not None:
                figure.add(line(run.time[chosen], values[chosen], name, colour, row, line_width=width))
    return figure


def _recorded(quantity: Quantity) -> str:
    return recorded_name(quantity.column("estimate"))


def _row(run: Run, quantity: Quantity) -> Spec:
    columns = [run.column(name) for name in (_recorded(quantity), quantity.column("estimate"))]
    limits = axis_range([values for values in columns if values is not None], run.settled)
    return axis(f"{quantity.symbol} [{quantity.shown_unit}]", range=limits)
