"""What sensors make of a recording: gain, delay, noise and faults. A value that is not valid is NaN."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from ..plants import sensors
from .motions import PERIOD, Recording, columns, stream

SENSORS: Mapping[str, sensors.Sensor] = {
    **{name: getattr(sensors.Sensors(), name) for name in ("theta", "theta_dot", "tau_m", "z_ddot")},
    "grip_force": sensors.Sensor(noise=0.3, bias=2.0),
}
"""Those that scenarios have by default, and one of the grip force."""
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
    """Each of a signal: a key of SENSORS, or CLOCK."""


def offsets(seed: int, count: int) -> dict[str, FloatArray]:
    """Return bias and noise of all sensors in one run, a value a sample."""
    return {what: sensor.offsets(count, stream(f"noise of {what}", seed)) for what, sensor in SENSORS.items()}


def measured(recording: Recording, given: Sensors, seeds: Sequence[int]) -> dict[str, FloatArray]:
    """Return the signals that there are sensors of, (samples, runs); where a fault is the clock's, its rate."""

    def drawn(mean: float, sigma: float, what: str) -> FloatArray:
        values: FloatArray = mean + sigma * columns(what, seeds, 1)[0]
        return values

    angle = np.full(len(seeds), given.angle_gain)
    torque = drawn(given.tau_m_gain, given.tau_m_gain_sigma, "torque gain")
    base = drawn(given.z_ddot_gain, given.z_ddot_gain_sigma, "base gain")
    gain = {"theta": angle, "theta_dot": angle, "tau_m": torque, "z_ddot": base}
    true: dict[str, FloatArray] = {what: getattr(recording, what) for what in gain}
    if given.grip_gain is not None and recording.grip_force is not None:
        gain["grip_force"] = drawn(given.grip_gain, given.grip_gain_sigma, "grip gain")
        true["grip_force"] = recording.grip_force
    if any(what == CLOCK for what, _ in given.faults):
        gain[CLOCK], true[CLOCK] = np.ones(len(seeds)), np.ones_like(recording.theta)
    delay = drawn(given.z_ddot_delay, given.z_ddot_delay_sigma, "base delay")
    signals = {what: np.empty_like(values) for what, values in true.items()}
    for what, values in true.items():
        usual = SENSORS.get(what, sensors.Sensor())
        faults = tuple(fault for signal, fault in given.faults if signal == what)
        for run, seed in enumerate(seeds):
            late = delay[run] if what == "z_ddot" else 0.0
            sensor = replace(usual, gain_error=gain[what][run] - 1.0, delay=late, fault=faults)
            readings = sensor.measure(values[:, run], PERIOD, stream(f"noise of {what}", seed))
            signals[what][:, run] = sensor.corruption(recording.time, PERIOD, stream("spikes", seed)).of(readings)
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
