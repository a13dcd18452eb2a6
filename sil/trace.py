"""The trace of a run: truth, measured, estimated and health, one row a sample, the unit of each column in its name.

Frames that come at a divided rate are held until the next one; before the first, where a value was invalid, not
available or its frame lost, where the estimate may not be used, and where a sample has no answer of its own, there is
NaN. Made from the frames as they were on the bus, in whole columns.

The columns of the parameters are those of the estimator's model; their truth is there when the pilot is of that model.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from lever_cdkf.host_tools import codec, fields
from numpy.typing import NDArray

from .buslog import Frames
from .feedthrough import FEEDTHROUGH
from .loop import Recording
from .quantities import DYNAMICS, quantities

if TYPE_CHECKING:
    import polars

FloatArray = NDArray[np.float64]
Trace = dict[str, FloatArray]

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


def build(recording: Recording, frames: Frames) -> Trace:
    """The columns of trace.csv, in order."""
    sample = np.array(recording.sample, dtype=np.int64)
    count = len(recording.inputs.time)
    decoded = _Decoded(frames, sample, count, round(recording.scenario.period * 1e6))
    trace = _truth(recording)
    for column, message, field in MEASURED:
        trace[column] = decoded.at_samples(message, field)
    for column, message, field in ESTIMATED:
        trace[column] = decoded.at_samples(message, field)
    model = recording.scenario.config.choices["model"]
    for column, message, field in (*quantity_fields(model), *FEEDTHROUGH, *HEALTH):
        trace[column] = decoded.held(message, field)
    trace["dither_N_m"] = np.nan_to_num(decoded.at_samples("MOTOR_COMMAND", "dither"))
    return trace


def quantity_fields(model: str) -> Iterator[tuple[str, str, str]]:
    """Column, message and field of all that the estimator says of the pilot."""
    for quantity in quantities(model):
        values, sigmas = ("PILOT_DYNAMICS",) * 2 if quantity in DYNAMICS else ("PILOT_PARAMETERS", "PILOT_SIGMA")
        yield quantity.column("estimate"), values, quantity.key
        yield quantity.column("sigma"), sigmas, f"{quantity.key}_sigma"


def _truth(recording: Recording) -> Trace:
    inputs = recording.inputs
    values = {**inputs.truth.parameters, **vars(inputs.truth.dynamics)}
    return {
        "time_s": inputs.time,
        "theta_true_rad": np.array(recording.theta),
        "theta_dot_true_rad_s": np.array(recording.theta_dot),
        "z_ddot_true_m_s2": inputs.z_ddot,
        "tau_m_true_N_m": np.array(recording.tau_m),
        "trim_true_rad": inputs.truth.rest,
        **{quantity.column("true"): values[quantity.key] for quantity in recording.scenario.judged()},
    }


class _Decoded:
    """The fields of all frames, decoded a message at a time when first asked for."""

    def __init__(self, frames: Frames, sample: NDArray[np.int64], count: int, period_us: int) -> None:
        self._frames, self._sample, self._count, self._period_us = frames, sample, count, period_us
        self._messages: dict[str, tuple[NDArray[np.int64], dict[str, FloatArray]]] = {}

    def _message(self, name: str) -> tuple[NDArray[np.int64], dict[str, FloatArray]]:
        if name not in self._messages:
            where = self._frames.of(codec.message(name).frame_id)
            sample, decoded = self._sample[where], fields.columns(name, self._frames.data[where])
            if "time_low" in decoded:
                own = fields.belongs(decoded, sample * self._period_us)
                sample, decoded = sample[own], {field: values[own] for field, values in decoded.items()}
            self._messages[name] = sample, decoded
        return self._messages[name]

    def at_samples(self, message: str, field: str) -> FloatArray:
        """The field at each sample; NaN without a frame or with a cleared validity bit."""
        sample, decoded = self._message(message)
        valid = decoded.get(f"{field}_valid", np.ones(len(sample)))
        column = np.full(self._count, np.nan)
        column[sample] = np.where(valid == 0.0, np.nan, decoded[field])
        return column

    def held(self, message: str, field: str) -> FloatArray:
        """The last value of the field at or before each sample; NaN before the first.

        Counts go on beyond their bits and start from 0, also if the firmware has counted in an earlier run.
        """
        sample, decoded = self._message(message)
        values = decoded[field]
        if field in fields.COUNTS and len(values):
            values = np.unwrap(values, period=float(fields.COUNTS[field])) - values[0]
        last = np.searchsorted(sample, np.arange(self._count), side="right")
        return np.concatenate(((np.nan,), values))[last]


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
