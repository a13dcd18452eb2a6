"""Files of columns as signals: text with a header, MF4 with signals, Parquet, MAT, NPZ.

Each column has its name, and a unit where the file says one; each has a time, which is a column too.
"""

from __future__ import annotations

import gc
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import Array, FloatArray
from ..runtime.extras import require
from ..runtime.quiet_asammdf import quiet_asammdf
from . import text_table
from .clock import RunningClock
from .recorded import Signal
from .units import factor, split_name

_TIME = re.compile(
    r"(time|timestamps?|t|zeit|temps|epoch|utc)([_ ]?(rel|abs|stamp|s|ms|us|µs|ns|sec|seconds?))?$", re.IGNORECASE
)

Columns = dict[str, tuple[Array, str]]
"""Values and unit by name, all of one length."""

_SET_BACK = 1.0
"""[s] by which the time of a row goes back where the clock was set; by less, rows are out of order."""
_UNSORTED = 0.1
"""Share of rows whose time goes back, from which on the rows are not in order of time at all."""
_TIME_UNITS = {1.0: "s", 1e-3: "ms", 1e-6: "us", 1e-9: "ns"}


@dataclass(frozen=True)
class _Times:
    """A column of time."""

    name: str
    unit: str
    at: FloatArray
    """[s]"""
    notes: tuple[str, ...]


def is_table(path: str) -> bool:
    """Return whether a file has columns and not CAN frames. Raise LeverError."""
    suffix = Path(path.removesuffix(".gz")).suffix.lower()
    if suffix in (".parquet", ".pq", ".mat", ".npz", ".tsv"):
        return True
    if suffix == ".csv" and Path(path).is_file():
        return not text_table.has_frames(path)
    if suffix in (".txt", ".dat") and Path(path).is_file():
        return text_table.is_text_table(path)
    return suffix == ".mf4" and Path(path).is_file() and not _has_frames(path)


def read_table(path: str, time: str | None = None, time_unit: str = "") -> list[Signal]:
    """Return all columns of numbers, with the time of each [s]; raise LeverError.

    `time` names the column that is it, `time_unit` its unit, which else is the column's, or found by the steps.
    """
    readers: dict[str, Callable[[str, str | None, str], list[Signal]]] = {
        ".parquet": _parquet,
        ".pq": _parquet,
        ".mat": _mat,
        ".npz": _npz,
        ".mf4": _mf4,
    }
    reader = readers.get(Path(path).suffix.lower(), _text)
    try:
        return reader(path, time, time_unit)
    except LeverError:
        raise
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror or error}") from None
    except Exception as error:  # each format has its own
        raise LeverError(f"{path}: it cannot be read: {type(error).__name__}: {error}") from None


def signals_of(columns: Columns, where: str, time: str | None = None, time_unit: str = "") -> list[Signal]:
    """Return columns of one length as signals over their column of time. Raise LeverError."""
    name = find_time(columns, where, time)
    values, unit = columns[name]
    times = _times(name, values, time_unit or unit, where)
    return [
        _signal(label, times, values, unit)
        for label, (values, unit) in columns.items()
        if label != name and values.dtype.kind in "biuf"
    ]


def _signal(name: str, recorded: _Times, values: Array, unit: str, words: str = "") -> Signal:
    """Return a column over its recorded times, which go on where their clock was set back."""
    clock = RunningClock(_SET_BACK)
    time = clock.running(recorded.at)
    notes = (*recorded.notes, *clock.note())
    return Signal(name, time, np.asarray(values, np.float64), unit, words, recorded.name, recorded.unit, notes)


def _times(name: str, values: Array, unit: str, where: str) -> _Times:
    """Return a column of time in seconds, with a note where its unit is a guess. Raise LeverError."""
    at = seconds(values, unit, f"{where}: {name}")
    if unit or values.dtype.kind in "mM":
        return _Times(name, unit, at, ())
    taken, step = _TIME_UNITS[time_scale(values)], _usual_step(at)
    rate = f" ({1.0 / step:.4g} Hz)" if step else ""
    return _Times(name, taken, at, (f"{name} has no unit: taken as {taken}{rate}",))


def find_time(columns: Columns, where: str, wanted: str | None = None, say: str | None = None) -> str:
    """Return the name of the column that is the time. Raise LeverError, in which `say` tells how to name it."""
    names = list(columns)
    if wanted:
        matches = [name for name in names if wanted in (name, split_name(name)[0])]
    else:
        dates = [name for name in names if columns[name][0].dtype.kind in "mM"]
        matches = [*filter(_TIME.match, names), *dates]
    if not matches:
        what = f"no column {wanted}" if wanted else "no column of time that is known by its name"
        raise LeverError(f"{where}: {what}: {say or _SAY_TIME.format('COLUMN')}; it has {_some(names)}")
    return matches[0]


def seconds(values: Array, unit: str, where: str) -> FloatArray:
    """Return times in seconds: numbers with a unit, or by their step; or dates. Raise LeverError."""
    if values.dtype.kind in "mM":
        kind = "datetime64[ns]" if values.dtype.kind == "M" else "timedelta64[ns]"
        at = np.asarray(values.astype(kind).astype(np.int64), np.float64) * 1e-9
        _check_sorted(at, where)
        return at
    if values.dtype.kind not in "iuf":
        raise LeverError(f"{where} is no column of numbers or dates")
    if not np.isfinite(values).all():
        raise LeverError(f"{where} has {int((~np.isfinite(values)).sum())} rows without a time: remove them")
    _check_sorted(values, where)
    scale = factor("time", unit) if unit else time_scale(values)
    if scale is None:
        raise LeverError(f"{where} is in {unit}, which is no unit of time known here: s, ms, us, ns")
    return np.asarray(values, np.float64) * scale


def _check_sorted(values: Array, where: str) -> None:
    """Raise LeverError for rows that are not in order of time. A clock that is set back does so at a few places."""
    back = int(np.count_nonzero(values[1:] < values[:-1]))
    if back > _UNSORTED * len(values):
        raise LeverError(f"{where} goes back in {back:,} of {len(values):,} rows: sort by time")


def _usual_step(values: Array) -> float:
    """Return the median of the steps forward; 0 without any."""
    steps = np.diff(values.astype(np.float64))
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else 0.0


def time_scale(values: Array) -> float:
    """Return seconds in the unit of times that do not say it: samples of this tool come every 0.1 to 20 ms."""
    step = _usual_step(values)
    return 1.0 if step < 0.09 else 1e-3 if step < 90.0 else 1e-6 if step < 90e3 else 1e-9


_SAY_TIME = "say which by --map time={0} (`lever map`: --time {0})"


def _some(names: list[str]) -> str:
    shown = ", ".join(names[:12])
    return f"{shown} and {len(names) - 12} more" if len(names) > 12 else shown or "no columns"


# --- formats ---------------------------------------------------------------------------------------------------------


def _text(path: str, time: str | None, time_unit: str) -> list[Signal]:
    signals = signals_of(text_table.read(path), path, time, time_unit)
    if (encoding := text_table.encoding_of(path)) == text_table.UTF_8:
        return signals
    note = f"The text is not UTF-8: it is read as {encoding}"
    return [replace(each, notes=(*each.notes, note)) for each in signals]


def _parquet(path: str, time: str | None, time_unit: str) -> list[Signal]:
    require("files", "pyarrow")
    from pyarrow import parquet

    table = parquet.read_table(path)
    columns: Columns = {}
    for each in table.schema:
        values = table.column(each.name).to_numpy()
        if values.dtype.kind in "biufmM":
            unit = ((each.metadata or {}).get(b"unit") or b"").decode()
            columns[each.name] = (values, unit or split_name(each.name)[1])
    return signals_of(columns, path, time, time_unit)


def _mf4(path: str, time: str | None, time_unit: str) -> list[Signal]:
    signals: dict[str, Signal] = {}
    with _opened_mf4(path) as file:
        start = file.header.start_time.timestamp()
        for channel in file.iter_channels(skip_master=True):
            if channel.samples.ndim == 1 and channel.samples.dtype.kind in "biuf" and channel.name not in signals:
                values = channel.samples.astype(np.float64)
                if channel.invalidation_bits is not None:
                    values = np.where(np.asarray(channel.invalidation_bits, bool), np.nan, values)
                times = _Times("", "s", start + channel.timestamps, ())
                signals[channel.name] = _signal(channel.name, times, values, channel.unit or "", channel.comment or "")
    return list(signals.values())


def _has_frames(path: str) -> bool:
    """Return whether an MF4 file holds CAN frames as they were on the bus."""
    with _opened_mf4(path) as file:
        return any("CAN_DataFrame" in name for name in file.channels_db)


def _opened_mf4(path: str) -> Any:
    require("mf4")
    from asammdf import MDF

    with quiet_asammdf():
        try:
            return MDF(path)
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
        gc.collect()
    raise LeverError(f"{path}: it cannot be read: {reason}")


def _npz(path: str, time: str | None, time_unit: str) -> list[Signal]:
    with np.load(path, allow_pickle=False) as arrays:
        return _of_arrays({name: arrays[name] for name in arrays.files}, path, time, time_unit)


def _mat(path: str, time: str | None, time_unit: str) -> list[Signal]:
    with open(path, "rb") as file:
        is_hdf = b"MATLAB 7.3" in file.read(128) or (file.seek(0) == 0 and file.read(8) == b"\x89HDF\r\n\x1a\n")
    require("files", "h5py" if is_hdf else "scipy")
    arrays: dict[str, Any] = {}
    if is_hdf:
        import h5py

        with h5py.File(path, "r") as content:
            content.visititems(lambda name, each: arrays.update(_hdf_array(name, each)))
    else:
        from scipy.io import loadmat

        for name, each in loadmat(path, squeeze_me=True, struct_as_record=False, simplify_cells=True).items():
            if not name.startswith("__"):
                arrays |= _flattened(name, each)
    return _of_arrays(arrays, path, time, time_unit)


def _hdf_array(name: str, each: Any) -> dict[str, Any]:
    values = np.squeeze(each[()]) if hasattr(each, "shape") else None
    return {} if values is None or name.startswith("#") else {name.replace("/", "."): values}


def _flattened(name: str, content: Any) -> dict[str, Any]:
    """Return fields of structures by their path: IMU.z."""
    if isinstance(content, Mapping):
        return {
            path: each for key, inner in content.items() for path, each in _flattened(f"{name}.{key}", inner).items()
        }
    return {name: np.asarray(content)}


def _of_arrays(arrays: Mapping[str, Array], where: str, time: str | None, time_unit: str) -> list[Signal]:
    """Return arrays by name; each has the time of its own structure, else the one of its length."""
    series = {name: np.asarray(each) for name, each in arrays.items() if np.ndim(each) == 1 and np.size(each) > 1}
    series = {name: each for name, each in series.items() if each.dtype.kind in "biufmM"}
    times = [name for name in series if (name == time if time else _TIME.match(name.rpartition(".")[2]))]
    if not times:
        raise LeverError(
            f"{where}: {f'no array {time}' if time else 'no array of time that is known by its name'}: "
            f"{_SAY_TIME.format('NAME')}; it has {_some(list(series))}"
        )
    signals = []
    for name, values in series.items():
        fitting = [each for each in times if len(series[each]) == len(values) and each != name]
        own = [each for each in fitting if each.rpartition(".")[0] == name.rpartition(".")[0]]
        if name not in times and fitting and values.dtype.kind in "biuf":
            chosen = (own or fitting)[0]
            at = _times(chosen, series[chosen], time_unit or split_name(chosen)[1], where)
            signals.append(_signal(name, at, values, split_name(name)[1]))
    return signals
