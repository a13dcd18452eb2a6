"""What is known of a run before it starts, in whole columns: all that does not depend on the estimator.

The one place for what a scenario means: run/loop.py and fast/ take the same columns, and only step through them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.can.codec import Value
from lever_cdkf.can.commander import KEEP_ALIVE
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from ..aircraft.flight import Flight
from ..plants import excitation, sensors
from ..plants.truth import BLOCK, Conditions, Truth
from .scenario import Scenario

OF_LEVER = ("theta", "theta_dot", "tau_m", "grip_force")
"""Signals of the lever, whose readings depend on the run."""


@dataclass(frozen=True)
class Inputs:
    """One value a sample."""

    time: FloatArray
    truth: Truth
    z_ddot: FloatArray
    """True base acceleration [m/s^2]; with an aircraft the gust, until the run has made it that of the pilot's seat."""
    sensed: FloatArray
    """The same where the accelerometer is."""
    z_ddot_measured: FloatArray
    """With an aircraft, of the gust."""
    torque: FloatArray
    """Commanded by the scenario itself [N m]."""
    disturbance: FloatArray
    """Unmeasured torque in the lever [N m]."""
    missing: dict[str, BoolArray]
    """For each of sensors.VALUES and sensors.FRAMES."""

    @property
    def base(self) -> FloatArray:
        """z_ddot_measured; NaN where it is marked invalid."""
        return np.where(self.missing["z_ddot"], sensors.INVALID, self.z_ddot_measured)


@dataclass(frozen=True)
class Readings:
    """How a sensor of the lever reads its signal."""

    sensor: sensors.Sensor
    offsets: FloatArray
    """Bias and noise."""
    corruption: sensors.Corruption | None
    """Faults, and NaN where it is marked invalid; None: nothing of the kind."""


def prepare(scenario: Scenario) -> Inputs:
    """Return the parts of a run that do not depend on the estimator."""
    time, period = scenario.time(), scenario.period
    base = excitation.total(scenario.base, time, scenario.streams("base", scenario.base))
    dropouts = scenario.sensors.dropout
    gone = {}
    for what in (*sensors.VALUES, *sensors.FRAMES):
        gone[what] = sensors.missing(dropouts, what, time, period, scenario.streams("dropout", dropouts))
    measured = scenario.sensors.z_ddot.measure(base, period, scenario.stream("z_ddot"))
    if scenario.sensors.z_ddot.fault:
        measured = scenario.corruption("z_ddot", time).of(measured)
    return Inputs(
        time=time,
        truth=scenario.truth(time),
        z_ddot=base,
        sensed=base if scenario.aircraft is None else np.full_like(base, np.nan),
        z_ddot_measured=measured,
        torque=excitation.total(scenario.torque, time, scenario.streams("torque", scenario.torque)),
        disturbance=excitation.total(scenario.disturbance, time, scenario.streams("disturbance", scenario.disturbance)),
        missing=gone,
    )


def conditions(scenario: Scenario, inputs: Inputs) -> Conditions:
    """Return what acts on the lever."""
    return Conditions(
        inputs.z_ddot,
        scenario.period,
        scenario.pilot.process_noise,
        scenario.motor.lag,
        scenario.stream("process"),
        disturbance=inputs.disturbance,
        ahead=BLOCK if scenario.aircraft is None else 1,
    )


def flight(scenario: Scenario, inputs: Inputs) -> Flight | None:
    """Return the helicopter around the lever, where there is one.

    The first acceleration of the cabin is in `inputs` then.
    """
    if scenario.aircraft is None:
        return None
    hovering = Flight(scenario.aircraft, scenario.period, inputs.z_ddot.copy())
    inputs.z_ddot[:] = np.nan
    inputs.z_ddot[0], inputs.sensed[0] = hovering.z_ddot, hovering.sensed
    return hovering


def readings(scenario: Scenario, inputs: Inputs, name: str) -> Readings:
    """Return the readings of the sensor of one of sensors.VALUES, which there must be."""
    sensor: sensors.Sensor = getattr(scenario.sensors, name)
    corruption, missing = None, inputs.missing[name]
    if sensor.fault or missing.any():
        corruption = scenario.corruption(name, inputs.time)
        corruption.offset[missing] = sensors.INVALID
    return Readings(sensor, sensor.offsets(len(inputs.time), scenario.stream(name)), corruption)


def commands(scenario: Scenario, time: FloatArray) -> dict[int, Mapping[str, Value]]:
    """Return what to send at the samples before which a COMMAND goes out.

    That is a reset with the scenario's choices at the start, the dither as it changes, and while it or a mitigation is
    on, one that keeps them alive.
    """
    changes = {int(np.searchsorted(time, when - 1e-9)): rms for when, rms in scenario.dithers()}
    sent: dict[int, Mapping[str, Value]] = {0: {"request": "reset", "dither_rms": 0.0, **scenario.config.choices}}
    repetition = max(1, round(KEEP_ALIVE / scenario.period))
    if scenario.config.choices["mitigation"] != "none":
        sent = {sample: {} for sample in range(0, len(time), repetition)} | sent
    for (sample, rms), end in zip(changes.items(), [*changes, len(time)][1:], strict=True):
        sent[sample] = {**sent.get(sample, {}), "dither_rms": rms}
        if rms > 0.0:
            sent |= {later: {} for later in range(sample + repetition, end, repetition)}
    return sent
