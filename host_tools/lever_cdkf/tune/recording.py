"""The samples in a log, as the firmware takes them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..can import codec
from ..can.estimator_frames import INPUTS, why_refused
from ..can.logs import incomplete
from ..errors import LeverError
from ..firmware.config import Config, setting
from ..firmware.estimator import Health
from ..firmware.innovations import FRAME, samples_of
from ..firmware.sample_clock import period_of
from ..numeric.arrays import Array
from ..signals.mapped_frames import MappedFrames, frames_for_estimator
from ..signals.reading import Reading


@dataclass(frozen=True)
class Recording:
    """Part of a log."""

    samples: Array
    """Of dtype innovations.SAMPLE."""
    period: float
    """Between two samples, as period_of() says [s]."""
    bus: str
    choices: dict[str, str]
    """Of model, preload, estimator and adaptation, by COMMAND in the log; the firmware's defaults without."""
    health: Health
    """Counts of what was lost, corrupt or late."""
    notes: tuple[str, ...] = ()
    """What was guessed of mapped signals or is odd, a sentence each."""

    @property
    def duration(self) -> float:
        """From the first sample to the last, gaps included [s]."""
        return float(self.time[-1])

    @property
    def time(self) -> Array:
        """Of each sample since the first [s]; time_us wraps, and goes on where its sender has started it anew."""
        steps = _steps(self.samples) * 1e-6
        return np.concatenate(([0.0], np.cumsum(np.where(steps > 0.0, steps, self.period))))

    def without_delay(self, delay: float) -> Array:
        """Return the samples with the base acceleration as it is measured `delay` later [s]."""
        measured = self.samples["z_ddot_valid"]
        if delay == 0.0 or not measured.any():
            return self.samples
        samples, time = self.samples.copy(), self.time
        samples["z_ddot"] = np.interp(time + delay, time[measured], samples["z_ddot"][measured])
        return samples


def read(
    paths: Sequence[str | os.PathLike[str]],
    reading: Reading | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    period: float = setting("sample_period").default,
) -> Recording:
    """Return the samples that `reading` says, or all of lever.dbc; raise LeverError.

    `period` [s] is the sample_period that is set.
    """
    reading = reading or Reading(is_of_lever_dbc=True)
    traffic = frames_for_estimator(list(map(str, paths)), reading)
    log, inputs = traffic.recording, [codec.message(name).frame_id for name in INPUTS]
    pieces = []
    for chunk in traffic.chunks():
        pieces.append(chunk[np.isin(chunk["id"], inputs)])
        if progress is not None:
            progress(log.done, log.size, "reading the log")
    name = ", ".join(log.paths)
    if reading.channel is None and traffic.other_samples:
        buses = " or --channel ".join(sorted({str(traffic.channel), *traffic.other_samples}))
        raise LeverError(f"{name}: samples on more than one bus: choose by --channel {buses}")
    notes = [incomplete(log.ends_early)] if log.ends_early else []
    notes += traffic.loaded.notes if isinstance(traffic, MappedFrames) else ()
    return replace(_recording(np.concatenate(pieces), str(traffic.channel), name, period), notes=tuple(notes))


def _recording(frames: Array, bus: str, log: str, set_to: float) -> Recording:
    received = np.zeros(len(frames), FRAME)
    for field in ("id", "length", "data"):
        received[field] = frames[field]
    samples, choices, health = samples_of(received)
    if len(samples) < 2:
        why = why_refused(health.corrupt, health.late) or "it holds no more"
        raise LeverError(f"{log}: too few samples to tune on, {len(samples)}: {why}")
    period = 1e-6 * period_of(np.maximum(_steps(samples), 0), 1e6 * set_to)
    lowest, highest = setting("sample_period").least, setting("sample_period").greatest
    if lowest <= period <= highest:  # so that samples at the log's own rate are not counted as lost
        health = samples_of(received, Config(settings={"sample_period": period}))[2]
    return Recording(samples, period, bus, choices, health)


def _steps(samples: Array) -> Array:
    """From each sample to the next [us]; less than half the range of time_us ahead is forward, all else back."""
    return np.diff(samples["time_us"]).astype(np.int32)
