"""The trace of a run: truth, measured, estimated and health, one row a sample, the unit of each column in its name.

Frames that come at a divided rate are held until the next one; before the first, where a value was invalid, not
available or its frame lost, where the estimate may not be used, and where a sample has no answer of its own, there is
NaN.

The columns of the parameters are those of the estimator's model; their truth is there when the pilot is of that model.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ..firmware.quantities import DYNAMICS, quantities

if TYPE_CHECKING:
    import polars

Trace = dict[str, FloatArray]

CONVERGED_AFTER = 15.0
"""Time [s] from which on estimates are judged, unless a scenario says otherwise."""

WHOLE = ("mode", "faults", "lost", "corrupt", "late", "restarts")
"""Columns of whole numbers."""

# column of the trace, its message and field
MEASURED = (
    ("theta_measured_rad", "LEVER_SAMPLE", "theta"),
    ("theta_dot_measured_rad_s", "LEVER_SAMPLE", "theta_dot"),
    ("z_ddot_measured_m_s2", "BASE_SAMPLE", "z_ddot"),
    ("tau_m_measured_N_m", "LEVER_SAMPLE", "tau_m"),
    ("grip_force_measured_N", "GRIP_SAMPLE", "grip_force"),
)
ESTIMATED = (
    ("theta_estimate_rad", "STATE_ESTIMATE", "theta"),
    ("theta_dot_estimate_rad_s", "STATE_ESTIMATE", "theta_dot"),
    ("nis", "STATE_ESTIMATE", "nis"),
)
HEALTH = (
    ("mode", "HEALTH", "mode"),
    ("faults", "HEALTH", "faults"),
    ("lost", "LINK_HEALTH", "lost"),
    ("corrupt", "LINK_HEALTH", "corrupt"),
    ("late", "LINK_HEALTH", "late"),
    ("restarts", "HEALTH", "restarts"),
    ("excitation_rad_s", "HEALTH", "excitation"),
)


def quantity_fields(model: str) -> Iterator[tuple[str, str, str]]:
    """Column, message and field of all that the estimator says of the pilot."""
    for quantity in quantities(model):
        values, sigmas = ("PILOT_DYNAMICS",) * 2 if quantity in DYNAMICS else ("PILOT_PARAMETERS", "PILOT_SIGMA")
        yield quantity.column("estimate"), values, quantity.key
        yield quantity.column("sigma"), sigmas, f"{quantity.key}_sigma"


def write_csv(trace: Trace, path: Path) -> None:
    """trace.csv with six decimals; NaN stands as `NaN`, a whole number that is not known yet as nothing."""
    _frame(trace).write_csv(path, float_precision=6)


def write_csv_rows(trace: Trace, file: BinaryIO, held: list[tuple[list[str], NDArray[np.bool_]]]) -> None:
    """The same rows without the header, in half the time: `held` are neighbouring columns that change only at certain
    rows; the text of them is made there and repeated."""
    import polars

    columns: dict[str, object] = dict(trace)
    for names, changed in held:
        changed[0] = True
        text = BytesIO()
        _frame({name: trace[name][changed] for name in names}).write_csv(text, include_header=False, float_precision=6)
        lines = polars.Series(text.getvalue().decode("ascii").splitlines())
        columns[names[0]] = lines.gather(np.cumsum(changed) - 1)
        for name in names[1:]:
            del columns[name]
    polars.DataFrame(columns).write_csv(file, include_header=False, float_precision=6, quote_style="never")


def _frame(trace: Trace) -> polars.DataFrame:
    import polars

    columns = {name: polars.Series(values) for name, values in trace.items()}
    for name in columns.keys() & set(WHOLE):
        columns[name] = columns[name].fill_nan(None).cast(polars.Int64)
    return polars.DataFrame(columns)
