"""Samples as the frames of lever.dbc that an inceptor would have sent: what a replay, a search and a view take."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ..can import codec
from ..can.bulk import FRAME, Frames
from ..can.estimator_frames import EstimatorFrames
from ..can.logs import Recording
from ..firmware.config import Config
from .reading import Loaded, Progress, Reading, read
from .resample import Samples, at_period

_SAMPLES_AT_ONCE = 1 << 15
BUS = "mapped"
"""Name of the bus that the frames are on."""


def frames_of(samples: Samples) -> Frames:
    """LEVER_SAMPLE, GRIP_SAMPLE where a grip is mapped, and BASE_SAMPLE of each, with E2E protection."""
    count, columns = len(samples.time_us), samples.columns
    nothing = np.full(count, np.nan)
    counters = np.arange(count)
    names = ["LEVER_SAMPLE", *(["GRIP_SAMPLE"] if "grip_force" in columns else []), "BASE_SAMPLE"]
    frames = np.zeros((count, len(names)), FRAME)
    for place, name in enumerate(names):
        contents = [each.name for each in codec.message(name).signals if each.name in (*_CONTENTS, "time_us")]
        values = {key: columns.get(key, nothing) if key in _CONTENTS else samples.time_us for key in contents}
        frames["id"][:, place] = codec.message(name).frame_id
        frames["data"][:, place] = codec.encode_columns(name, counters, values)
    frames["length"] = 8
    frames["time_us"] = samples.time_us[:, np.newaxis]
    in_order: Frames = frames.reshape(-1)
    return in_order


_CONTENTS = ("theta", "theta_dot", "tau_m", "z_ddot", "grip_force")


class MappedFrames:
    """A can.estimator_frames.EstimatorFrames of logs that do not speak lever.dbc."""

    def __init__(self, logs: Sequence[str | Path], reading: Reading, progress: Progress | None = None) -> None:
        """Read all of it. Raise LeverError."""
        self.loaded: Loaded = read(logs, reading, progress)
        self.recording = self.loaded.recording
        self.channel: str | None = "_".join(self.loaded.buses)[:24] or BUS
        self.frames = self.loaded.frames
        self.others = {"other_identifiers": max(self.loaded.frames - self.loaded.used, 0) if self.loaded.buses else 0}
        self.corrupt_answers = 0
        self.other_samples: set[str] = set()
        time_us = self.loaded.samples.time_us
        self.first_us, self.last_us = int(time_us[0]), int(time_us[-1])

    def at_its_rate(self, config: Config) -> Config:
        """`config` with the sample period of the log, as at_period() says. Raises LeverError."""
        return at_period(config, self.loaded.samples.period)

    def chunks(self) -> Iterator[Frames]:
        """Yield the frames."""
        frames = frames_of(self.loaded.samples)
        for first in range(0, len(frames), _SAMPLES_AT_ONCE):
            yield frames[first : first + _SAMPLES_AT_ONCE]


def frames_for_estimator(
    logs: Sequence[str | Path], reading: Reading, progress: Progress | None = None
) -> EstimatorFrames | MappedFrames:
    """Return the frames in logs, as they are or of what is mapped. Raise LeverError."""
    if reading.is_of_lever_dbc:
        return EstimatorFrames(Recording(logs), reading.channel, reading.start, reading.length)
    return MappedFrames(logs, reading, progress)
