"""What the sensors said in the conditions of `lever envelope`, and what the firmware made of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array

from ...batch import firmware, pilots, plant
from ...batch.firmware import ClosedLoop
from ...batch.motions import Motion, Recording, arms, lanes, truth
from ...batch.sensors import Sensors, lost, measured
from ...envelope.condition import Condition
from ...plants.sensors import INVALID

LANES = 64
"""Runs filtered at a time: more would save little time and cost memory."""


@dataclass(frozen=True)
class Log:
    """All runs of a condition."""

    condition: Condition
    recording: Recording
    signals: Mapping[str, Array]
    """theta, theta_dot, tau_m, z_ddot as measured (samples, runs); NaN where not valid or lost."""
    trim: Array
    """(runs,) angle about which each pilot moves the lever, before any re-trim [rad]."""
    firmware: firmware.Track | None
    """None where the firmware does not know a setting of the condition."""


def chunks(conditions: Iterable[Condition], seeds: int) -> list[list[Condition]]:
    """Return conditions that are filtered together: as long, with the same process noise, at most LANES runs."""
    by_kind: dict[tuple[object, ...], list[list[Condition]]] = {}
    for condition in conditions:
        motion = condition.motion
        kind = (motion.duration, motion.process_noise, motion.pilot == "arm", condition.closed_loop)
        groups = by_kind.setdefault(kind, [[]])
        if groups[-1] and seeds * sum(one.runs for one in (*groups[-1], condition)) > LANES:
            groups.append([])
        groups[-1].append(condition)
    return [group for groups in by_kind.values() for group in groups]


def logs(chunk: Sequence[Condition], seeds: int) -> Iterator[Log]:
    """Yield the logs of a chunk; equal motions are simulated once."""
    recordings = _recordings({_key(condition) for condition in chunk if condition.closed_loop is None}, seeds)
    for condition in chunk:
        own = range(seeds * condition.runs)
        trim = arms(own)[3][0]
        if condition.closed_loop is not None:
            yield _closed_loop(condition, condition.closed_loop, own, trim)
        else:
            recording = recordings[_key(condition)]
            signals = measured(recording, condition.sensors, own)
            yield Log(
                condition, recording, signals, trim, _firmware(condition, signals, recording.response is not None)
            )


class _Key(NamedTuple):
    """Conditions with the same of this have the same recording."""

    motion: Motion
    runs: int


def _key(condition: Condition) -> _Key:
    return _Key(condition.motion, condition.runs)


def _recordings(keys: Iterable[_Key], seeds: int) -> dict[_Key, Recording]:
    """Return all recordings of a chunk: arms are simulated side by side, other pilots one by one."""
    recordings = {key: pilots.record(key.motion, range(seeds * key.runs)) for key in keys if key.motion.pilot != "arm"}
    given = {key: lanes(key.motion, range(seeds * key.runs)) for key in keys if key.motion.pilot == "arm"}
    if not given:
        return recordings
    theta, theta_dot = plant.run(plant.beside(list(given.values())))
    first = 0
    for key, part in given.items():
        own = slice(first, first + seeds * key.runs)
        first = own.stop
        signals = (theta[:, own], theta_dot[:, own], part.tau_m, part.z_ddot)
        recordings[key] = Recording(key.motion.time, *signals, truth(part))
    return recordings


def _firmware(condition: Condition, signals: Mapping[str, Array], response: bool) -> firmware.Track | None:
    try:
        return firmware.estimates(Config(settings=condition.settings), signals, response)
    except SettingsError:
        return None


def _closed_loop(condition: Condition, loop: ClosedLoop, seeds: Sequence[int], trim: Array) -> Log:
    """Return the log of a firmware that dithers by itself, as part of its run; what was lost is drawn as there."""
    config = Config(settings=condition.settings)
    recording, track = firmware.closed_loop(config, condition.motion, seeds, loop, lambda: None)
    signals = measured(recording, Sensors(), seeds)
    gone = lost(seeds, len(recording.time), loop.lost, loop.lost_for)
    for name in signals if loop.whole else ("theta", "theta_dot", "tau_m"):
        signals[name][gone] = INVALID
    return Log(condition, recording, signals, trim, track)
