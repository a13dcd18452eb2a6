"""Columns of samples as the firmware takes them; what cannot be meant is refused in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import LeverError
from ..numeric.arrays import FloatArray
from ..numeric.derivative import in_degrees
from .library import struct_dtype

_GREATEST = {"theta": (math.pi, "rad"), "theta_dot": (20.0, "rad/s")}
"""Of a lever; a column that is beyond it in more than _OUTLIERS of its values is in degrees."""
_OUTLIERS = 0.01
_COMPARED = 60_000
"""Samples whose rates are compared with the slope of their angles."""
_OTHER_UNIT = 30.0
"""Between two sample periods, as a factor: more is another unit of time."""


def sample_array(samples: Mapping[str, Any], period: float) -> NDArray[Any]:
    """Return an array of lever_sample_t from columns, which native.run_samples() describes.

    `period`: sample_period [s].

    Raise LeverError.
    """
    if not isinstance(samples, Mapping):
        raise LeverError(f"samples are a {type(samples).__name__}: give its columns, as {{'time_us': …, 'theta': …}}")
    dtype = struct_dtype("lever_sample_t")
    fields = dtype.names or ()
    unknown = sorted(str(name) for name in samples if name not in fields)
    if unknown:
        raise LeverError(f"unknown columns of samples: {', '.join(unknown)}; they may be {', '.join(fields)}")
    if "time_us" not in samples:
        raise LeverError("samples have no column time_us, the time of each [µs]")
    columns = {name: _column(name, column) for name, column in samples.items()}
    taken = np.zeros(len(columns["time_us"]), dtype)
    for name, values in columns.items():
        if len(values) != len(taken):
            raise LeverError(f"samples: {name} has {len(values)} values, time_us has {len(taken)}")
    taken["time_us"] = _time_us(columns["time_us"], period)  # to 32 bits: wraps
    for name in (name for name in columns if f"{name}_valid" in fields):
        taken[name] = columns[name]
        taken[f"{name}_valid"] = columns.get(f"{name}_valid", ~np.isnan(columns[name]))
        infinite = np.flatnonzero(taken[f"{name}_valid"] & np.isinf(columns[name]))
        if len(infinite):
            raise LeverError(
                f"samples: {name} is {columns[name][infinite[0]]:g} at index {infinite[0]}: NaN is missing"
            )
    for name, (greatest, unit) in _GREATEST.items():
        _check_angle(name, taken[name][taken[f"{name}_valid"]], greatest, unit)
    _check_slope(taken, columns["time_us"], period)
    return taken


def _column(name: str, column: Any) -> NDArray[Any]:
    values = np.asarray(column)
    if values.ndim != 1:
        raise LeverError(f"samples: {name} has {values.ndim} dimensions; it must be one column")
    if values.dtype.kind not in ("biuf" if name.endswith("_valid") else "iuf"):
        raise LeverError(f"samples: {name} is no column of numbers")
    if values.dtype.kind == "f" and name != "time_us":
        beyond = np.flatnonzero(np.isfinite(values) & (np.abs(values) > np.finfo(np.float32).max))
        if len(beyond):
            raise LeverError(f"samples: {name} is {values[beyond[0]]:g} at index {beyond[0]}: more than a float holds")
    return values


def _time_us(values: NDArray[Any], period: float) -> NDArray[np.int64]:
    odd = np.flatnonzero(~np.isfinite(values) | (values != np.rint(values)))
    if len(odd):
        raise LeverError(
            f"samples: time_us is {values[odd[0]]:g} at index {odd[0]}; it must be whole numbers, of microseconds"
        )
    time_us = values.astype(np.int64)
    if len(time_us) > 1:
        steps = np.diff(time_us).astype(np.int32)  # of 32 bits that wrap
        step, period_us = float(np.median(steps)), 1e6 * period
        if not period_us / _OTHER_UNIT <= step <= period_us * _OTHER_UNIT:
            raise LeverError(
                f"samples: time_us goes on by {step:g} a sample, and sample_period is {period_us:g} µs: is it in "
                "microseconds?"
            )
    return time_us


@dataclass(frozen=True)
class _Signal:
    time: FloatArray
    values: FloatArray


def _check_slope(taken: NDArray[Any], time_us: NDArray[Any], period: float) -> None:
    """Small angles and rates in degrees: seen by one being the slope of the other."""
    taken = taken[:_COMPARED]
    steps = np.diff(_time_us(time_us[:_COMPARED], period)).astype(np.int32)
    if (steps <= 0).any():  # of no recording that is in order
        return
    time = 1e-6 * np.concatenate(([0.0], np.cumsum(steps, dtype=np.float64)))
    theta, rate = (_Signal(time, np.where(taken[f"{name}_valid"], taken[name], np.nan)) for name in _GREATEST)
    if found := in_degrees(theta, rate):
        raise LeverError(f"samples: {found[1]}: numpy.radians() converts")


def _check_angle(name: str, values: NDArray[Any], greatest: float, unit: str) -> None:
    beyond = np.abs(values[np.isfinite(values)]) > greatest
    if beyond.sum() > _OUTLIERS * len(values):
        raise LeverError(
            f"samples: {name} is beyond ±{greatest:.3g} {unit} in {100.0 * beyond.mean():.0f} % of them: is it in "
            "degrees? numpy.radians() converts"
        )
