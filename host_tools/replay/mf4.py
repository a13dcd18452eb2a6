"""signals.mf4: the physical signals with their units, for asammdf, PlotJuggler and whatever else reads ASAM MDF 4.

Two groups: what comes with every sample, and what the estimator sends at its divided rate, at the samples at which it
did; and the same two of a recorded estimator. Values in single precision, which holds every step of the bus exactly
enough; NaN is what was not known.
"""

from __future__ import annotations

import warnings
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..can import codec
from ..extras import require
from ..files import writing
from ..firmware.quantities import quantities, recorded_name
from ..results.feedthrough import FEEDTHROUGH
from ..results.trace import ESTIMATED, HEALTH, MEASURED, Trace

Signals = list[tuple[str, str, str]]
"""Column of the trace, name and unit in the file."""


_DERIVED = {"nis": "1", "faults": ""}  # fields.py


def _unit(message: str, field: str) -> str:
    if field in _DERIVED:
        return _DERIVED[field]
    return codec.message(message).get_signal_by_name(field).unit or ""


def _samples(with_recorded: bool) -> Signals:
    signals = [(column, f"{field}_measured", _unit(message, field)) for column, message, field in MEASURED]
    estimated = [(column, f"{field}_estimate", _unit(message, field)) for column, message, field in ESTIMATED]
    signals += [*estimated, ("dither_N_m", "dither", "N m")]
    return signals + (_recorded(estimated) if with_recorded else [])


def _pilot(model: str) -> Signals:
    return [(each.column(kind), f"{each.key}_{kind}", each.unit) for each in quantities(model) for kind in _KINDS]


_KINDS = ("estimate", "sigma")


def _recorded(signals: Signals) -> Signals:
    return [(recorded_name(column), f"{name}_recorded", unit) for column, name, unit in signals]


class Mf4:
    """Written a piece at a time; complete after close()."""

    def __init__(self, path: Path, model: str, start_us: int, with_recorded: bool) -> None:
        """`start_us`: absolute time of the first sample [us since 1970], as far as the recording knows it."""
        require("mf4")
        from asammdf import MDF

        self._path = path
        self._groups = {"samples": _samples(with_recorded), "estimates": _pilot(model) + _others()}
        if with_recorded:
            self._groups["recorded estimates"] = _recorded(_pilot(model))
        self._indices: dict[str, int] = {}
        with writing(path):
            self._file: Any = MDF(version="4.10", temporary_folder=str(path.parent))
        start = datetime.fromtimestamp(start_us * 1e-6, tz=timezone.utc)
        self._file.header.start_time = start
        self._file.file_history = [_history(start)]

    def add(self, trace: Trace, published: NDArray[np.bool_], recorded: NDArray[np.bool_]) -> None:
        """Further samples; `published` and `recorded` are those with new estimates of the replay and the recording."""
        everything = np.ones(len(published), np.bool_)
        for (name, signals), rows in zip(self._groups.items(), (everything, published, recorded), strict=False):
            if rows.any():
                self._append(name, signals, trace, rows)

    def _append(self, name: str, signals: Signals, trace: Trace, rows: NDArray[np.bool_]) -> None:
        from asammdf import Signal

        time = trace["time_s"][rows]
        values = [trace[column][rows].astype(np.float32) for column, _, _ in signals]
        with writing(self._path), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # asammdf's own, of numpy and pandas
            if name in self._indices:
                self._file.extend(self._indices[name], [(time, None), *((column, None) for column in values)])
            else:
                group = [
                    Signal(column, time, name=named, unit=unit)
                    for column, (_, named, unit) in zip(values, signals, strict=True)
                ]
                self._indices[name] = self._file.append(group, acq_name=name, common_timebase=True)

    def close(self) -> None:
        """Writes the file."""
        with writing(self._path), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._file.save(self._path, overwrite=True, add_history_block=False)
            self._file.close()


def _others() -> Signals:
    feedthrough = [(column, f"feedthrough_{field}", _unit(message, field)) for column, message, field in FEEDTHROUGH]
    return feedthrough + [(column, field, _unit(message, field)) for column, message, field in HEALTH]


def _history(start: datetime) -> Any:
    """Who made the file; with the recording's own time, so that two replays give the same bytes."""
    from asammdf.blocks.v4_blocks import FileHistory

    history = FileHistory()
    history.time_stamp = start
    history.comment = "<FHcomment><TX>lever replay</TX><tool_id>lever</tool_id></FHcomment>"
    return history
