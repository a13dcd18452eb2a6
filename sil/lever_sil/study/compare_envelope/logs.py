"""What the sensors said in the conditions of `lever envelope`, and what the firmware made of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array

from ...batch import firmware, pilots
from ...batch.firmware import ClosedLoop
from ...batch.motions import Recording, arms, simulated
from ...batch.sensors import Sensors, lost, measured
from ...envelope.condition import Condition
from ...plants.sensors import INVALID


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


def log_of(condition: Condition, seeds: int) -> Log:
    """Return the log of a condition with so many pilots, or some times as many where runs draw."""
    own, motion = range(seeds * condition.runs), condition.motion
    trim = arms(own)[3][0]
    if condition.closed_loop is not None:
        return _closed_loop(condition, condition.closed_loop, own, trim)
    recording = simulated([(motion, own)])[0] if motion.pilot == "arm" else pilots.record(motion, own)
    signals = measured(recording, condition.sensors, own)
    return Log(condition, recording, signals, trim, _firmware(condition, signals, recording.response is not None))


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
