"""Which frames of a recording are the estimator's: those of one bus, and a count of all the others."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from . import codec
from .bulk import ERROR, EXTENDED, FD, REMOTE, Frames
from .logs import LogError, Recording

INPUTS = ("LEVER_SAMPLE", "BASE_SAMPLE", "GRIP_SAMPLE", "COMMAND")
"""What the estimator takes."""
LATE = 10.0
"""[s] by which frames may be recorded out of order: so long after the end of a part it is complete."""

_KEPT_BEFORE_SAMPLES = 1000  # commands that a recording may have long before its first sample
_OTHERS = ("other_buses", "other_identifiers", "extended", "remote", "error", "fd")


def why_refused(corrupt: int, late: int) -> str:
    """Return why an estimator has refused frames, by its counts of them; empty when it has refused none."""
    reasons = [f"{corrupt:,} corrupt (CRC, length or value)"] if corrupt else []
    if late:
        reasons.append(f"{late:,} repeated or out of sequence (does the sender count each message from 0 to 15?)")
    return ", ".join(reasons)


class EstimatorFrames:
    """Picks the frames; the counts are of what has been read so far.

    Parameters
    ----------
    recording
        The logs.
    channel
        The bus that is read; None: the only one that has any samples.
    start, length
        The part of recorded time that is read [s]; COMMAND frames before it belong to it.
    """

    def __init__(
        self, recording: Recording, channel: str | None = None, start: float = 0.0, length: float = float("inf")
    ) -> None:
        self.recording = recording
        self._start, self._end = start or -math.inf, start + length  # a clock that was set back belongs to the whole
        self.channel = channel
        """Name of the bus, once it is known."""
        self.frames = 0
        """All frames in the part."""
        self.others = dict.fromkeys(_OTHERS, 0)
        """Frames that are neither for nor from the estimator, by kind."""
        self.corrupt_answers = 0
        """Recorded answers of an estimator whose CRC or length is wrong; left out."""
        self.first_us = self.last_us = 0
        """Recorded times of the first and last frame of any kind [us]."""
        self.other_samples: set[str] = set()
        """Other buses that also carry samples."""
        messages = codec.database().messages
        self._answers = {m.frame_id: m.name for m in messages if m.name not in INPUTS}
        self._in_dbc = np.zeros(0x800, np.bool_)
        self._in_dbc[[m.frame_id for m in messages]] = True
        self._base = codec.message("BASE_SAMPLE").frame_id
        self._command = codec.message("COMMAND").frame_id
        self._bus: int | None = None

    def chunks(self) -> Iterator[Frames]:
        """Yield the estimator's frames, inputs and recorded answers, in recorded order.

        Yields
        ------
        Frames
            Those of a part of the recording, with recorded times [µs].

        Raises
        ------
        LogError
            The recording has no sample for the estimator, or cannot be read on.
        """
        waiting: list[Frames] = []
        for frames in self._part():
            if self._bus is None:
                self._find_bus(frames)
            if self._bus is not None:
                for each in (*waiting, frames):
                    yield self._select(each)
                waiting.clear()
            else:
                kept = frames[(frames["id"] == self._command) & (frames["flags"] == 0)]
                room = _KEPT_BEFORE_SAMPLES - sum(map(len, waiting))
                waiting.append(kept[: max(room, 0)].copy())
                self._count_others(frames, np.zeros(len(frames), np.bool_))
        if self._bus is None:
            raise LogError(self._why_no_samples())

    def _part(self) -> Iterator[Frames]:
        """Yield the frames of the part, counted, and commands before it."""
        beginning: int | None = None
        for frames in self.recording.chunks():
            beginning = int(frames["time_us"][0]) if beginning is None else beginning
            since = (frames["time_us"] - beginning) * 1e-6
            inside = (since >= self._start) & (since < self._end)
            if inside.any():
                times = frames["time_us"][inside]
                self.first_us = self.first_us if self.frames else int(times[0])
                self.last_us = int(times[-1])
                self.frames += len(times)
            before = (since < self._start) & (frames["id"] == self._command) & (frames["flags"] == 0)
            chosen = inside | before
            yield frames if chosen.all() else frames[chosen]
            if since[-1] > self._end + LATE:
                return

    def _find_bus(self, frames: Frames) -> None:
        names = self.recording.buses.names()
        carrying = self._carrying_samples(frames)
        if self.channel is not None:
            if self.channel in names and names.index(self.channel) in carrying:
                self._bus = names.index(self.channel)
        elif len(carrying) > 1:
            buses = ", ".join(names[bus] for bus in carrying)
            raise LogError(f"{self.recording.paths[0]}: several buses carry samples: choose with --channel: {buses}")
        elif carrying:
            self._bus = carrying[0]
            self.channel = names[self._bus]

    def _carrying_samples(self, frames: Frames) -> list[int]:
        """Buses with a BASE_SAMPLE that has the right CRC."""
        base_samples = frames[(frames["id"] == self._base) & (frames["flags"] == 0) & (frames["length"] == 8)]
        intact = codec.check_columns("BASE_SAMPLE", base_samples["data"])
        return [int(bus) for bus in np.unique(base_samples["bus"][intact])]

    def _select(self, frames: Frames) -> Frames:
        in_dbc = self._in_dbc[np.minimum(frames["id"], 0x7FF)] & (frames["flags"] == 0)
        ours = in_dbc & (frames["bus"] == self._bus)
        if not ours.all():
            self._count_others(frames, ours)
            elsewhere = self._carrying_samples(frames[in_dbc & ~ours])
            names = self.recording.buses.names()
            self.other_samples.update(names[bus] for bus in elsewhere)
        selected: Frames = frames[ours]
        right = self._right(selected)
        self.corrupt_answers += int(len(right) - right.sum())
        kept: Frames = selected[right]
        return kept

    def _right(self, frames: Frames) -> NDArray[np.bool_]:
        """Return False for recorded answers that are corrupt; inputs are the estimator's to judge."""
        right = np.ones(len(frames), np.bool_)
        for identifier, name in self._answers.items():
            where = np.flatnonzero(frames["id"] == identifier)
            if len(where):
                answers = frames[where]
                right[where] = (answers["length"] == 8) & codec.check_columns(name, answers["data"])
        return right

    def _count_others(self, frames: Frames, ours: NDArray[np.bool_]) -> None:
        """Count each frame that is not ours under the first kind that fits."""
        left, flags = ~ours, frames["flags"]
        kinds = {
            "error": flags & ERROR != 0,
            "other_buses": frames["bus"] != (0xFFFF if self._bus is None else self._bus),
            "fd": flags & FD != 0,
            "remote": flags & REMOTE != 0,
            "extended": flags & EXTENDED != 0,
        }
        if self._bus is None:
            del kinds["other_buses"]
        for kind, is_kind in kinds.items():
            self.others[kind] += int(np.count_nonzero(left & is_kind))
            left &= ~is_kind
        self.others["other_identifiers"] += int(np.count_nonzero(left))

    def _why_no_samples(self) -> str:
        names = self.recording.buses.names()
        where = f"on bus {self.channel} " if self.channel is not None else ""
        there = f"; its buses: {', '.join(names)}" if names else ""
        wanted = f"{self._base:#x} BASE_SAMPLE"
        paths = self.recording.paths
        if self._start > 0.0 and not self.frames:
            return f"{', '.join(paths)}: there is nothing from {self._start:g} s on (--start)"
        return (
            f"{', '.join(paths)}: {self.frames} frames, but no sample ({wanted}) {where}in them{there}; for messages "
            f"other than those of lever.dbc, `lever map {shlex.quote(paths[0])} --dbc FILE` finds the signals"
        )


class Pairing:
    """BASE_SAMPLE with the LEVER_SAMPLE and GRIP_SAMPLE of its counter, across chunks; time beyond 32 bits."""

    def __init__(self) -> None:
        self._rest: Frames | None = None
        self._time_us: int | None = None

    def add(self, frames: Frames) -> dict[str, NDArray[np.float64]]:
        """Return the samples that further frames complete, as run_samples() takes them.

        Corrupt frames are left out, and samples with the time of the one before.
        """
        identifiers = {name: codec.message(name).frame_id for name in ("LEVER_SAMPLE", "GRIP_SAMPLE", "BASE_SAMPLE")}
        parts = []
        for name, identifier in identifiers.items():
            where = np.flatnonzero((frames["id"] == identifier) & (frames["length"] == 8))
            parts.append(where[codec.check_columns(name, frames["data"][where])])
        both = frames[np.sort(np.concatenate(parts))]
        if self._rest is not None:
            both = np.concatenate((self._rest, both))
        is_base = both["id"] == identifiers["BASE_SAMPLE"]
        last = np.flatnonzero(is_base)
        end = last[-1] + 1 if len(last) else 0
        self._rest, both, is_base = both[end:].copy(), both[:end], is_base[:end]
        return self._samples(both, np.flatnonzero(is_base))

    def _samples(self, both: Frames, base: NDArray[np.intp]) -> dict[str, NDArray[np.float64]]:
        of_base = codec.decode_columns("BASE_SAMPLE", both["data"][base])
        time_us = self._continued(of_base["time_us"].astype(np.int64))
        columns = {"time_us": time_us.astype(np.float64)}
        for message, names in (("LEVER_SAMPLE", ("theta", "theta_dot", "tau_m")), ("GRIP_SAMPLE", ("grip_force",))):
            before, paired = self._before(both, base, codec.message(message).frame_id)
            decoded = codec.decode_columns(message, both["data"][before])
            for name in names:
                columns[name] = np.where(paired & (decoded[f"{name}_valid"] != 0.0), decoded[name], np.nan)
        columns["z_ddot"] = np.where(of_base["z_ddot_valid"] != 0.0, of_base["z_ddot"], np.nan)
        new = np.diff(time_us, prepend=-1 if self._time_us is None else self._time_us) != 0
        if len(time_us):
            self._time_us = int(time_us[-1])
        return {name: values[new] for name, values in columns.items()}

    @staticmethod
    def _before(both: Frames, base: NDArray[np.intp], identifier: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the last frame with that identifier before each BASE_SAMPLE, and whether it belongs to it."""
        there = np.flatnonzero(both["id"] == identifier)
        if not len(there):
            return np.zeros_like(base), np.zeros(len(base), np.bool_)
        place = np.searchsorted(there, base) - 1
        before = there[np.maximum(place, 0)]
        counters = both["data"][:, 1] & 15
        after_last = before > np.concatenate(([-1], base[:-1]))
        return before, (place >= 0) & after_last & (counters[before] == counters[base])

    def _continued(self, time_us: NDArray[np.int64]) -> NDArray[np.int64]:
        """Beyond 32 bits: less than half their range ahead is forward."""
        if not len(time_us):
            return time_us
        start = int(time_us[0]) if self._time_us is None else self._time_us
        steps = np.diff(time_us, prepend=start & 0xFFFFFFFF)
        continued: NDArray[np.int64] = start + np.cumsum((steps + (1 << 31)) % (1 << 32) - (1 << 31))
        return continued


def read_samples(traffic: EstimatorFrames) -> dict[str, NDArray[np.float64]]:
    """Return all samples of a recording.

    Parameters
    ----------
    traffic
        The frames of the estimator, of which nothing has been read yet.

    Returns
    -------
    dict
        What run_samples() takes: time_us [µs], theta [rad], theta_dot [rad/s], tau_m [N m], z_ddot [m/s²] and
        grip_force [N], NaN where a value is not valid.

    Raises
    ------
    LogError
        The recording has no sample for the estimator, or cannot be read on.
    """
    pairing = Pairing()
    chunks = [pairing.add(frames) for frames in traffic.chunks()]
    return {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
