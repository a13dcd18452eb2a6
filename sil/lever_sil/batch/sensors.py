"""What sensors make of a recording: gain, delay, noise and faults. A value that is not valid is NaN."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from ..plants import sensors
from .motions import PERIOD, Recording, columns, stream

NOISE: Mapping[str, float] = {
    name: getattr(sensors.Sensors(), name).noise for name in ("theta", "theta_dot", "tau_m", "z_ddot")
}
"""Standard deviation of a sample [rad, rad/s, N m, m/s^2]."""
GRIP_NOISE, GRIP_BIAS = 0.3, 2.0
"""Of the force sensor [N]."""
CLOCK = "clock_rate"
"""As a signal with faults: how fast the sender's clock runs [1]."""


@dataclass(frozen=True)
class Sensors:
    """Measured is gain times the truth `delay` seconds ago, plus noise.

    A sigma [1, s] is that of a normal error that each run draws anew.
    """

    z_ddot_gain: float = 1.0
    z_ddot_delay: float = 0.0
    tau_m_gain: float = 1.0
    angle_gain: float = 1.0
    """Of theta and theta_dot."""
    z_ddot_gain_sigma: float = 0.0
    z_ddot_delay_sigma: float = 0.0
    tau_m_gain_sigma: float = 0.0
    grip_gain: float | None = None
    """Of the sensor of the grip force; None: there is none."""
    grip_gain_sigma: float = 0.0
    lever_lost: float = 0.0
    """Share of the LEVER_SAMPLEs that never arrive, at random: theta, theta_dot and tau_m are not valid then."""
    faults: tuple[tuple[str, sensors.Fault], ...] = ()
    """Each of a signal: a key of NOISE, or CLOCK."""


def measured(recording: Recording, given: Sensors, seeds: Sequence[int]) -> dict[str, FloatArray]:
    """Return the signals that there are sensors of, (samples, runs); where a fault is the clock's, its rate."""

    def drawn(mean: float, sigma: float, what: str) -> FloatArray:
        values: FloatArray = mean + sigma * columns(what, seeds, 1)[0]
        return values

    gain = {
        "theta": np.full(len(seeds), given.angle_gain),
        "theta_dot": np.full(len(seeds), given.angle_gain),
        "tau_m": drawn(given.tau_m_gain, given.tau_m_gain_sigma, "torque gain"),
        "z_ddot": drawn(given.z_ddot_gain, given.z_ddot_gain_sigma, "base gain"),
    }
    delay = drawn(given.z_ddot_delay, given.z_ddot_delay_sigma, "base delay")
    signals = {}
    for what, noise in NOISE.items():
        true: FloatArray = getattr(recording, what)
        late = _delayed(true, delay) if what == "z_ddot" and delay.any() else true
        signals[what] = gain[what] * late + noise * columns(f"noise of {what}", seeds, len(true))
    if given.grip_gain is not None and recording.grip_force is not None:
        errors = GRIP_BIAS + GRIP_NOISE * columns("noise of grip_force", seeds, len(recording.time))
        gains = drawn(given.grip_gain, given.grip_gain_sigma, "grip gain")
        signals["grip_force"] = gains * recording.grip_force + errors
    if any(what == CLOCK for what, _ in given.faults):
        signals[CLOCK] = np.ones_like(recording.theta)
    for what in dict.fromkeys(what for what, _ in given.faults):
        sensor = sensors.Sensor(fault=tuple(fault for signal, fault in given.faults if signal == what))
        for run, seed in enumerate(seeds):
            corruption = sensor.corruption(recording.time, PERIOD, stream("spikes", seed))
            signals[what][:, run] = corruption.of(signals[what][:, run])
    if given.lever_lost:
        gone = lost(seeds, len(recording.time), given.lever_lost)
        for what in ("theta", "theta_dot", "tau_m"):
            signals[what][gone] = sensors.INVALID
    return signals


def lost(seeds: Sequence[int], count: int, share: float, length: float = PERIOD) -> BoolArray:
    """Return which samples are lost, (samples, runs): a share of all at random, in stretches of this length [s]."""
    each = round(length / PERIOD)
    hit = np.stack([stream("lost", seed).random(-(-count // each)) < share for seed in seeds], axis=1)
    return np.repeat(hit, each, axis=0)[:count]


def _delayed(signal: FloatArray, delay: FloatArray) -> FloatArray:
    """Return each column so much later [s], by interpolation; before its start it had its first value."""
    at = np.arange(len(signal), dtype=np.float64)
    return np.stack(
        [np.interp(at - late / PERIOD, at, column) for late, column in zip(delay, signal.T, strict=True)], axis=1
    )
