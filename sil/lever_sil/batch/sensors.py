"""What sensors make of a recording: gain, delay, noise and faults. A value that is not valid is NaN."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from .motions import PERIOD, Recording, columns, stream

NOISE: Mapping[str, float] = {"theta": 1e-3, "theta_dot": 1e-2, "tau_m": 2e-3, "z_ddot": 0.01}
"""Standard deviation of a sample [rad, rad/s, N m, m/s^2], as in lever_sil/plants/sensors.py."""
GRIP_NOISE, GRIP_BIAS = 0.3, 2.0
"""Of the force sensor [N]."""
SPIKE = 0.3
"""[rad]"""


@dataclass(frozen=True)
class Fault:
    """Something wrong with one signal from `start` to `end` [s]."""

    what: str
    """A key of NOISE, or "clock_rate", of the sender's clock."""
    kind: str
    """stuck: the last value stays; zero: 0 exactly; sign: turned over; invalid: marked so; spikes: 1 % of the samples
    are off by SPIKE; gain: `size` times as large; late: by `size` [s]."""
    start: float = 0.0
    end: float = np.inf
    size: float = 1.0


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
    faults: tuple[Fault, ...] = ()


def measured(recording: Recording, sensors: Sensors, seeds: Sequence[int]) -> dict[str, FloatArray]:
    """Return the signals that there are sensors of, (samples, runs); where a fault is the clock's, its rate."""

    def drawn(mean: float, sigma: float, what: str) -> FloatArray:
        values: FloatArray = mean + sigma * columns(what, seeds, 1)[0]
        return values

    gain = {
        "theta": np.full(len(seeds), sensors.angle_gain),
        "theta_dot": np.full(len(seeds), sensors.angle_gain),
        "tau_m": drawn(sensors.tau_m_gain, sensors.tau_m_gain_sigma, "torque gain"),
        "z_ddot": drawn(sensors.z_ddot_gain, sensors.z_ddot_gain_sigma, "base gain"),
    }
    delay = drawn(sensors.z_ddot_delay, sensors.z_ddot_delay_sigma, "base delay")
    signals = {}
    for what, noise in NOISE.items():
        true: FloatArray = getattr(recording, what)
        late = _delayed(true, delay) if what == "z_ddot" and delay.any() else true
        signals[what] = gain[what] * late + noise * columns(f"noise of {what}", seeds, len(true))
    if sensors.grip_gain is not None and recording.grip_force is not None:
        errors = GRIP_BIAS + GRIP_NOISE * columns("noise of grip_force", seeds, len(recording.time))
        gains = drawn(sensors.grip_gain, sensors.grip_gain_sigma, "grip gain")
        signals["grip_force"] = gains * recording.grip_force + errors
    if any(fault.what == "clock_rate" for fault in sensors.faults):
        signals["clock_rate"] = np.ones_like(recording.theta)
    for fault in sensors.faults:
        _spoil(signals[fault.what], fault, recording.time, seeds)
    if sensors.lever_lost:
        gone = lost(seeds, len(recording.time), sensors.lever_lost)
        for what in ("theta", "theta_dot", "tau_m"):
            signals[what][gone] = np.nan
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


def _spoil(signal: FloatArray, fault: Fault, time: FloatArray, seeds: Sequence[int]) -> None:
    """Put the fault into the signal."""
    during = np.flatnonzero((time >= fault.start) & (time < fault.end))
    if fault.kind == "stuck":
        signal[during] = signal[max(0, during[0] - 1)]
    elif fault.kind == "zero":
        signal[during] = 0.0
    elif fault.kind == "sign":
        signal[during] *= -1.0
    elif fault.kind == "gain":
        signal[during] *= fault.size
    elif fault.kind == "late":
        signal[during] = signal[np.maximum(0, during - round(fault.size / PERIOD))]
    elif fault.kind == "invalid":
        signal[during] = np.nan
    elif fault.kind == "spikes":
        for run, seed in enumerate(seeds):
            draws = stream("spikes", seed)
            hit = draws.random(len(during)) < 0.01
            signal[during[hit], run] += SPIKE * draws.choice((-1.0, 1.0), int(hit.sum()))
    else:
        raise ValueError(f"unknown kind of fault: {fault.kind}")
