"""The trace of a run: truth, measured, estimated and health, one row a sample, the unit of each column in its name.

Frames that come at a divided rate are held until the next one; before the first, where a value was invalid, not
available or its frame lost, where the estimate may not be used, and where a sample has no answer of its own, there is
NaN.

The columns of the parameters are those of the estimator's model; their truth is there when the pilot is of that model.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..firmware.library import ffi, load
from ..firmware.quantities import DYNAMICS, quantities
from ..numeric.arrays import FloatArray

_lib = load("lever_bulk")

Trace = dict[str, FloatArray]

CONVERGED_AFTER = 15.0
"""Time [s] from which on estimates are judged, unless a scenario says otherwise."""

WHOLE = ("mode", "faults", "lost", "corrupt", "late", "restarts", "bounce", "evidence", "verdict")
"""Columns of whole numbers."""
_ROWS_AT_ONCE = 1 << 13  # that are made into text

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


STABILITY = (
    ("bounce", "STABILITY", "bounce"),
    ("gain_margin_dB", "STABILITY", "gain_margin"),
    ("gain_margin_sigma_dB", "STABILITY", "gain_margin_sigma"),
    ("modulus", "STABILITY", "modulus"),
    ("modulus_sigma", "STABILITY", "modulus_sigma"),
    ("bounce_frequency_Hz", "STABILITY", "frequency"),
)
CORRECTION = ("correction_rad", "CORRECTION", "correction")
"""Both only where the estimator knows the aircraft."""
TRUE_MARGIN = "gain_margin_true_dB"


def quantity_fields(model: str) -> Iterator[tuple[str, str, str]]:
    """Yield column, message and field of all that the estimator says of the pilot."""
    for quantity in quantities(model):
        values, sigmas = ("PILOT_DYNAMICS",) * 2 if quantity in DYNAMICS else ("PILOT_PARAMETERS", "PILOT_SIGMA")
        yield quantity.column("estimate"), values, quantity.key
        yield quantity.column("sigma"), sigmas, f"{quantity.key}_sigma"


def write_csv_header(columns: Iterable[str], file: BinaryIO) -> None:
    """Write the names of the columns of trace.csv."""
    file.write((",".join(columns) + "\n").encode("ascii"))


def write_csv_rows(trace: Trace, file: BinaryIO) -> None:
    """Write a line for each sample, with six decimals; NaN is written as `NaN`, an unknown whole number as nothing."""
    for first in range(0, len(trace["time_s"]), _ROWS_AT_ONCE):
        file.write(csv_lines({name: values[first : first + _ROWS_AT_ONCE] for name, values in trace.items()}).data)


def csv_lines(trace: Trace) -> NDArray[np.uint8]:
    """Return rows as text, to be written as bytes."""
    numbers = np.stack(list(trace.values()), axis=1, dtype=np.float64)
    text = np.empty(numbers.size * int(_lib.BULK_NUMBER), np.uint8)
    source, target = ffi.from_buffer("double[]", numbers), ffi.from_buffer("char[]", text)
    size = _lib.bulk_format_table(source, *numbers.shape, bytes(name in WHOLE for name in trace), target)
    return text[:size]
