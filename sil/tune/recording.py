"""The samples in a log, as the firmware takes them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.host_tools import codec, logs
from lever_cdkf.host_tools.errors import LeverError
from lever_cdkf.host_tools.estimator import Health
from lever_cdkf.host_tools.innovations import FRAME, Array, samples_of

_INPUTS = ("LEVER_SAMPLE", "BASE_SAMPLE")


@dataclass(frozen=True)
class Recording:
    """Part of a log."""

    samples: Array
    """Of dtype innovations.SAMPLE."""
    period: float
    """Between two samples: the median [s]."""
    bus: str
    health: Health
    """Counts of what was lost, corrupt or late."""

    @property
    def duration(self) -> float:
        """From the first sample to the last, gaps included [s]."""
        return float(self.time[-1]) if len(self.samples) else 0.0

    @property
    def time(self) -> Array:
        """Of each sample since the first [s]; time_us wraps."""
        steps = np.diff(self.samples["time_us"]).astype(np.int32)
        return np.concatenate(([0.0], np.cumsum(steps, dtype=np.int64) * 1e-6))


def read(
    paths: Sequence[str | os.PathLike[str]],
    bus: str | None = None,
    start: float = 0.0,
    length: float = float("inf"),
    progress: Callable[[int, int, str], None] | None = None,
) -> Recording:
    """The samples on `bus` (if not given: the one bus that has any) from `start` on for `length`, both [s] of recorded
    time. Raises LeverError."""
    log = logs.Recording(paths)
    identifiers = np.array([codec.message(name).frame_id for name in _INPUTS])
    begin: int | None = None
    pieces = []
    for chunk in log.chunks():
        begin = int(chunk["time_us"][0]) if begin is None else begin
        since = (chunk["time_us"] - begin) * 1e-6
        wanted = np.isin(chunk["id"], identifiers) & (chunk["flags"] == 0) & (since >= start) & (since < start + length)
        pieces.append(chunk[wanted])
        if progress is not None:
            progress(log.done, log.size, "reading the log")
        if since[-1] > start + length:
            break
    name = ", ".join(os.fspath(path) for path in paths)
    frames, chosen = _of_one_bus(np.concatenate(pieces), log.buses.names(), bus, name)
    return _recording(frames, chosen, name)


def _of_one_bus(frames: Array, names: Sequence[str], bus: str | None, log: str) -> tuple[Array, str]:
    """The frames of the bus that is asked for, or of the only one that has samples; and its name. Raises LeverError."""
    base = codec.message("BASE_SAMPLE").frame_id
    found = [names[index] for index in np.unique(frames["bus"][frames["id"] == base])]
    if not found:
        raise LeverError(f"{log}: no BASE_SAMPLE ({base:#x}) there, so no samples: see `lever dbc` for the messages")
    if bus is not None and bus not in found:
        raise LeverError(f"{log}: no samples on bus {bus}; there are some on {', '.join(found)}")
    if bus is None and len(found) > 1:
        raise LeverError(f"{log}: samples on more than one bus: choose by --bus {' or --bus '.join(found)}")
    chosen = bus or found[0]
    return frames[frames["bus"] == names.index(chosen)], chosen


def _recording(frames: Array, bus: str, log: str) -> Recording:
    received = np.zeros(len(frames), FRAME)
    for field in ("id", "length", "data"):
        received[field] = frames[field]
    samples, health = samples_of(received)
    if len(samples) < 2:
        raise LeverError(f"{log}: none of its samples is accepted: {health.corrupt} frames are corrupt (E2E)")
    steps = np.diff(samples["time_us"]).astype(np.int32)
    return Recording(samples, float(np.median(steps)) * 1e-6, bus, health)
