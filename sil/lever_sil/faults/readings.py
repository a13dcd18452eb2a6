"""What the sensors read, and the clock of their sender: as they should be, and with faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from .bus import Indices

SIGNALS = ("theta", "theta_dot", "tau_m", "z_ddot", "grip_force")
STEP: Mapping[str, float] = {"theta": 0.1, "theta_dot": 0.2, "tau_m": 0.5, "z_ddot": 2.0, "grip_force": 20.0}
"""Of an offset that comes at once [rad, rad/s, N m, m/s^2, N]."""
SPIKE: Mapping[str, float] = {"theta": 0.3, "theta_dot": 3.0, "tau_m": 1.5, "z_ddot": 10.0, "grip_force": 100.0}
GREATEST: Mapping[str, float] = {
    "theta": 3.2767, "theta_dot": 16.3835, "tau_m": 32.767, "z_ddot": 32.767, "grip_force": 655.34
}  # fmt: skip
"""What a frame can carry."""


@dataclass
class Reading:
    """Of one signal: factor * (true + noise) of the sample `source`, plus error; NaN is marked invalid."""

    source: NDArray[np.uint32]
    factor: FloatArray
    error: FloatArray


@dataclass
class Readings:
    """Of all, and the sender's time [us]."""

    of: dict[str, Reading]
    time_us: NDArray[np.int64]
    random: np.random.Generator

    @classmethod
    def right(cls, count: int, period: float, random: np.random.Generator) -> Readings:
        """Without a fault."""
        at = np.arange(count)
        readings = {
            name: Reading(at.astype(np.uint32), np.ones(count), np.full(count, 2.0 if name == "grip_force" else 0.0))
            for name in SIGNALS
        }
        return cls(readings, at * round(period * 1e6), random)


Fault = Callable[[Readings, Indices], None]
"""What happens to readings in some samples."""


def nothing(readings: Readings, during: Indices) -> None:
    """As it should be."""


def stuck(signal: str) -> Fault:
    """Hold the last value."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].source[during] = max(0, during[0] - 1)

    return spoil


def reads(signal: str, value: float) -> Fault:
    """Have the signal read this value, whatever is true."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].factor[during], readings.of[signal].error[during] = 0.0, value

    return spoil


def scaled(signal: str, factor: float) -> Fault:
    """Change the gain of the signal by this factor."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].factor[during] *= factor

    return spoil


def gain_drift(signal: str, factor: float) -> Fault:
    """Let the gain of the signal go to this factor, at a steady rate."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].factor[during] *= np.linspace(1.0, factor, len(during))

    return spoil


def step(signal: str) -> Fault:
    """Add an offset at once."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].error[during] += STEP[signal]

    return spoil


def drift(signal: str) -> Fault:
    """Let an offset grow to that of step(), at a steady rate."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.of[signal].error[during] += STEP[signal] * np.linspace(0.0, 1.0, len(during))

    return spoil


def spikes(signal: str) -> Fault:
    """Put one value in a hundred far off."""

    def spoil(readings: Readings, during: Indices) -> None:
        hit = during[readings.random.random(len(during)) < 0.01]
        readings.of[signal].error[hit] += SPIKE[signal] * readings.random.choice((-1.0, 1.0), len(hit))

    return spoil


def clock(change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Fault:
    """Change the sender's time: from the time since the fault began [s] to what the sender says of it."""

    def spoil(readings: Readings, during: Indices) -> None:
        start = readings.time_us[during[0]]
        since = (readings.time_us[during] - start) * 1e-6
        readings.time_us[during] = start + np.rint(change(since) * 1e6).astype(np.int64)

    return spoil


def clock_offset(seconds: float) -> Fault:
    """From the beginning of the fault on the clock is ahead by so much, for good."""

    def spoil(readings: Readings, during: Indices) -> None:
        readings.time_us[during[0] :] += round(seconds * 1e6)

    return spoil


def clock_wraps(readings: Readings, during: Indices) -> None:
    """Let the time pass 2^32 us."""
    readings.time_us += (1 << 32) - readings.time_us[during[0]]
