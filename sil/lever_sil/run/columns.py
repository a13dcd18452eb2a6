"""The trace of a run, made from the frames as they were on the bus, in whole columns.

Where a frame of the estimator comes at a divided rate, its values are held until the next one.
"""

from __future__ import annotations

import numpy as np
from lever_cdkf.can import codec, fields
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.results.feedthrough import FEEDTHROUGH
from lever_cdkf.results.ratios import TEST_RATIO
from lever_cdkf.results.trace import (
    CORRECTION,
    ESTIMATED,
    HEALTH,
    MEASURED,
    STABILITY,
    TRUE_MARGIN,
    Trace,
    quantity_fields,
)
from numpy.typing import NDArray

from ..aircraft.stability import critical_gearing
from .buslog import Frames
from .loop import Recording

_MARGIN_EVERY = 20  # samples: the true margin; linear in between
_MARGIN_MOST = 40.0  # as the firmware says at most [dB]
_AT_ONCE = 1000


def columns_of(recording: Recording, frames: Frames) -> Trace:
    """Return the columns of trace.csv, in order."""
    sample = recording.traffic.sample.astype(np.int64)
    count = len(recording.inputs.time)
    decoded = _Decoded(frames, sample, count, round(recording.scenario.period * 1e6))
    trace = _truth(recording)
    for column, message, field in MEASURED:
        trace[column] = decoded.at_samples(message, field)
    for column, message, field in ESTIMATED:
        trace[column] = decoded.at_samples(message, field)
    model = recording.scenario.config.choices["model"]
    watched = recording.scenario.aircraft is not None
    rated = recording.scenario.config.settings["publish_test_ratios"] > 0.0
    optional = (*(STABILITY if watched else ()), *(TEST_RATIO if rated else ()))
    for column, message, field in (*quantity_fields(model), *FEEDTHROUGH, *HEALTH, *optional):
        trace[column] = decoded.held(message, field)
    if watched:
        trace[CORRECTION[0]] = decoded.at_samples(*CORRECTION[1:])
    trace["dither_N_m"] = np.nan_to_num(decoded.at_samples("MOTOR_COMMAND", "dither"))
    return trace


def published(recording: Recording, frames: Frames) -> NDArray[np.bool_]:
    """At which samples the estimator has sent its parameters, and what else comes at that rate."""
    there = np.zeros(len(recording.inputs.time), np.bool_)
    there[recording.traffic.sample[frames.of(codec.message("PILOT_PARAMETERS").frame_id)]] = True
    return there


def _truth(recording: Recording) -> Trace:
    inputs = recording.inputs
    values = {**inputs.truth.parameters, **vars(inputs.truth.dynamics)}
    truth = {
        "time_s": inputs.time,
        "theta_true_rad": recording.theta,
        "theta_dot_true_rad_s": recording.theta_dot,
        "z_ddot_true_m_s2": inputs.z_ddot,
        "tau_m_true_N_m": recording.tau_m,
        "trim_true_rad": inputs.truth.rest,
        **{quantity.column("true"): values[quantity.key] for quantity in recording.scenario.judged()},
    }
    return truth if recording.scenario.aircraft is None else {**truth, TRUE_MARGIN: _true_margin(recording)}


def _true_margin(recording: Recording) -> FloatArray:
    """Return the true margin of the loop with the true arm [dB]."""
    coupled, inputs = recording.scenario.aircraft, recording.inputs
    assert coupled is not None
    at = np.arange(0, len(inputs.time), _MARGIN_EVERY)
    parts = (inputs.truth.transfer(at[first : first + _AT_ONCE]) for first in range(0, len(at), _AT_ONCE))
    critical = np.concatenate([critical_gearing(coupled.aircraft, transfer) for transfer in parts])
    margin = np.minimum(20.0 * np.log10(critical / coupled.gearing), _MARGIN_MOST)
    return np.interp(inputs.time, inputs.time[at], margin)


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
        """Return the field at each sample; NaN without a frame or with a cleared validity bit."""
        sample, decoded = self._message(message)
        valid = decoded.get(f"{field}_valid", np.ones(len(sample)))
        column = np.full(self._count, np.nan)
        column[sample] = np.where(valid == 0.0, np.nan, decoded[field])
        return column

    def held(self, message: str, field: str) -> FloatArray:
        """Return the last value of the field at or before each sample; NaN before the first.

        Counts go on beyond their bits and start from 0, also if the firmware has counted in an earlier run.
        """
        sample, decoded = self._message(message)
        values = decoded[field]
        if field in fields.COUNTS and len(values):
            values = np.unwrap(values, period=float(fields.COUNTS[field])) - values[0]
        last = np.searchsorted(sample, np.arange(self._count), side="right")
        return np.concatenate(((np.nan,), values))[last]
