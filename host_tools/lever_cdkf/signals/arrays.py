"""Arrays and frames of any library, in memory, as signals: columns with their time, and units where they say some."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import FloatArray
from .recorded import Signal
from .tables import Columns, find_time, seconds, time_scale
from .units import KINDS, normal, split_name


def columns_of(data: Any) -> Columns:
    """Return values and unit of each column of `data`; raise LeverError.

    It is a pandas or polars frame, an xarray Dataset, a structured array, or a mapping of arrays; an index or
    coordinate with a name, or of times, is a column too.
    """
    raw: dict[str, Any]
    if hasattr(data, "data_vars"):  # xarray
        raw = {str(name): each for name, each in data.variables.items()}
    elif isinstance(data, np.ndarray) and data.dtype.names:
        raw = {name: data[name] for name in data.dtype.names}
    elif isinstance(data, Mapping):
        raw = {str(name): each for name, each in data.items()}
    elif hasattr(data, "columns") and hasattr(data, "__getitem__"):  # pandas, polars
        raw = {str(name): data[name] for name in data.columns}
        index = getattr(data, "index", None)
        if index is not None and (index.name is not None or index.dtype.kind in "mMf"):
            raw.setdefault(str(index.name or "time"), index)
    else:
        raise LeverError(
            f"samples are a {type(data).__name__}: give a frame of pandas or polars, a Dataset of xarray, or columns "
            "as {'time': …, 'theta': …, 'z_ddot': …}"
        )
    columns: Columns = {}
    for name, each in raw.items():
        values = each.to_numpy() if hasattr(each, "to_numpy") else np.asarray(each)
        if hasattr(getattr(each, "dtype", None), "tz"):  # pandas' dates with a time zone
            values = getattr(each, "dt", each).tz_convert(None).to_numpy()
        if values.ndim == 1:
            attributes = getattr(each, "attrs", None) or {}
            columns[name] = (values, str(attributes.get("units", "")) or split_name(name)[1])
    return columns


def signals_by_input(columns: Columns, units: Mapping[str, str]) -> dict[str, Signal]:
    """Return the columns that are inputs of the firmware, by their names. Raise LeverError."""
    unknown = sorted(set(units) - {"time", *KINDS})
    if unknown:
        raise LeverError(f"units of {', '.join(unknown)}: they are of {', '.join(KINDS)}")
    time_name, values = _time(columns, units)
    lengths = {name: len(each) for name, (each, _) in columns.items() if len(each) != len(values)}
    signals = {}
    for name, (each, unit) in columns.items():
        key = _key(name)
        if key in KINDS and key != "time" and name != time_name:
            if name in lengths:
                raise LeverError(f"{name} has {lengths[name]} values, {time_name} has {len(values)}")
            if each.dtype.kind not in "biuf":
                raise LeverError(f"{name} is no column of numbers")
            signals[key] = Signal(name, values, np.asarray(each, np.float64), units.get(key) or unit)
    return signals


def _time(columns: Columns, units: Mapping[str, str]) -> tuple[str, FloatArray]:
    """Return the name of the column of time, and it in seconds. Raise LeverError."""
    name = find_time(columns, "samples", say="names={'time': 'column'} says which")
    values, own = columns[name]
    unit = units.get("time", own)
    time = seconds(values, unit or "s", f"samples: {name}")
    if values.dtype.kind in "iuf" and not unit and time_scale(values) != 1.0:
        likely = {1e-3: "ms", 1e-6: "us", 1e-9: "ns"}[time_scale(values)]
        step = float(np.median(np.diff(values)))
        hint = f"units={{'time': '{likely}'}} says so"
        raise LeverError(f"{name} goes on by {step:.3g} a sample: it looks like {likely}: {hint}")
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1e-3
    if not 5e-5 < step < 0.5:
        hint = "units={'time': …} says what it is in: s, ms, us or ns"
        raise LeverError(f"{name} goes on by {step:.3g} s a sample, in {unit or 's'}: {hint}")
    return name, time


def _key(name: str) -> str:
    """Return theta of theta, theta_deg and "theta [deg]"."""
    label, unit = split_name(name)
    if label == name and unit:
        for key in KINDS:
            if name.startswith(f"{key}_") and normal(name[len(key) :].replace("_", "/").strip("/")) == normal(unit):
                return key
    return label
