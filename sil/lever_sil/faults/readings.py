"""What the sensors read, and the clock of their sender: as they should be, and with faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..plants import sensors
from ..plants.sensors import Corruption
from .bus import Indices

SIGNALS = ("theta", "theta_dot", "tau_m", "z_ddot", "grip_force")
STEP: Mapping[str, float] = {"theta": 0.1, "theta_dot": 0.2, "tau_m": 0.5, "z_ddot": 2.0, "grip_force": 20.0}
"""The offset that a sensor gets [rad, rad/s, N m, m/s^2, N]."""
SPIKE: Mapping[str, float] = {"theta": 0.3, "theta_dot": 3.0, "tau_m": 1.5, "z_ddot": 10.0, "grip_force": 100.0}
GREATEST: Mapping[str, float] = {
    "theta": 3.2767, "theta_dot": 16.3835, "tau_m": 32.767, "z_ddot": 32.767, "grip_force": 655.34
}  # fmt: skip
"""What a frame can carry."""


@dataclass
class Readings:
    """Of all, and the sender's time [us]."""

    of: dict[str, Corruption]
    time_us: NDArray[np.int64]
    random: np.random.Generator

    @classmethod
    def right(cls, count: int, period: float, random: np.random.Generator) -> Readings:
        """Without a fault."""
        return cls(
            {name: Corruption.none(count, period) for name in SIGNALS}, np.arange(count) * round(period * 1e6), random
        )


Fault = Callable[[Readings, Indices], None]
"""What happens to readings in some samples."""


def nothing(readings: Readings, during: Indices) -> None:
    """As it should be."""


def wrong(fault: sensors.Fault, *signals: str) -> Fault:
    """Let a sensor, or some, have a fault."""

    def spoil(readings: Readings, during: Indices) -> None:
        for signal in signals:
            fault.corrupt(during, readings.of[signal], readings.random)

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
