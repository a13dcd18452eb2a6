"""What the sensors said in the conditions of `lever envelope`, and what the firmware made of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array

from ...batch import firmware, pilots
from ...batch.firmware import ClosedLoop
from ...batch.motions import Motion, Recording, arms, simulated
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
    recordings = _recordings({(each.motion, range(seeds * each.runs)) for each in chunk if each.closed_loop is None})
    for condition in chunk:
        own = range(seeds * condition.runs)
        trim = arms(own)[3][0]
        if condition.closed_loop is not None:
            yield _closed_loop(condition, condition.closed_loop, own, trim)
        else:
            recording = recordings[condition.motion, own]
            signals = measured(recording, condition.sensors, own)
            yield Log(
                condition, recording, signals, trim, _firmware(condition, signals, recording.response is not None)
            )


def _recordings(keys: Iterable[tuple[Motion, range]]) -> dict[tuple[Motion, range], Recording]:
    """Return all recordings of a chunk: arms are simulated side by side, other pilots one by one."""
    held = [key for key in keys if key[0].pilot == "arm"]
    others = {key: pilots.record(*key) for key in keys if key[0].pilot != "arm"}
    return others | dict(zip(held, simulated(held), strict=True))


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
