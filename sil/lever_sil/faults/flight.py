"""A pilot whose lever the firmware dithers by CAN: what is true, and what the firmware makes of what arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.firmware.library import struct_dtype
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..batch.firmware import MOTOR_LAG
from ..batch.motions import PERIOD, STRIDE, Motion, columns, lanes, stream, truth
from ..batch.plant import BatchPlant, Lanes, grip_force
from ..batch.sensors import GRIP_NOISE, NOISE
from ..fast.library import Struct, lib
from . import bus, readings
from .bus import Bus, Interval
from .readings import SIGNALS, Readings

DITHER = 0.3
"""rms that COMMANDs ask for [N m]."""
FREEZE = 12.0
"""From here on the parameters are held in flights that are frozen [s]."""
_NOISE = {**NOISE, "grip_force": GRIP_NOISE}


@dataclass(frozen=True)
class Record:
    """What was, at every sample, and the firmware's estimates at every STRIDE-th."""

    health: NDArray[Any]
    estimate: NDArray[Any]
    asked: FloatArray
    """The motor's last command [N m]."""
    results: tuple[int, ...]
    """Frames by enum lever_frame_result."""
    sent: int
    """Frames that arrived."""
    unanswered: int
    """Samples that did not end with a STATE_ESTIMATE."""


class Pilot:
    """One of many at random, with all that a flight of his has in common with the others of the same length."""

    def __init__(self, motion: Motion, seed: int) -> None:
        self.seed = seed
        self.lanes: Lanes = lanes(motion, [seed])
        self.count = len(motion.time)
        self.noise = {
            name: sigma * columns(f"noise of {name}", [seed], self.count)[:, 0] for name, sigma in _NOISE.items()
        }
        self.truth = {name: values[:, 0] for name, values in truth(self.lanes).items()}

    @cached_property
    def grip_force(self) -> FloatArray:
        """Of the hand on the lever in a flight without faults [N]; the motor does the same in all such."""
        plant = BatchPlant(self.lanes)
        self._fly(plant, None, Config(), *self._right(False))
        force: FloatArray = grip_force(self.lanes, plant.theta, plant.theta_dot)[:, 0]
        return force

    def fly(
        self,
        config: Config,
        time: Interval,
        on_bus: bus.Fault = bus.nothing,
        on_readings: readings.Fault = readings.nothing,
        grip: bool = False,
        frozen: bool = False,
    ) -> Record:
        """Return a flight with faults in a time [s].

        `grip`: there is a sensor of the grip force; `frozen`: the parameters are held from FREEZE on.
        """
        sent, read = self._right(grip)
        if frozen:
            bus.freeze(sent, FREEZE)
        on_readings(read, sent.samples(time))
        on_bus(sent, time)
        return self._fly(BatchPlant(self.lanes), self.grip_force if grip else None, config, sent, read)

    def _right(self, grip: bool) -> tuple[Bus, Readings]:
        random = stream("faults", self.seed)
        return Bus(self.count, PERIOD, grip, DITHER, random), Readings.right(self.count, PERIOD, random)

    def _fly(self, plant: BatchPlant, force: FloatArray | None, config: Config, sent: Bus, read: Readings) -> Record:
        estimator, struct, frames = Estimator(config), Struct("channel_t"), sent.delivered()
        rows = (self.count - 1) // STRIDE + 1
        health = np.zeros(self.count, struct_dtype("lever_health_t"))
        estimate = np.zeros(rows, struct_dtype("lever_estimate_t"))
        asked = np.zeros(self.count)
        channel = struct.pointer
        channel.lane = plant.struct.pointer[0]
        channel.decay, channel.step_seconds = math.exp(-PERIOD / MOTOR_LAG), PERIOD
        channel.z_ddot = struct.doubles(self.lanes.z_ddot[:, 0])
        if force is not None:
            channel.grip_force = struct.doubles(force)
        for sensor, name in zip(channel.sensor, SIGNALS, strict=True):
            of = read.of[name]
            sensor.noise, sensor.factor, sensor.error = (
                struct.doubles(values) for values in (self.noise[name], of.factor, of.error)
            )
            sensor.source = struct.array("uint32_t", of.source, np.uint32)
        channel.time_us = struct.array("uint32_t", read.time_us & 0xFFFFFFFF, np.uint32)
        channel.frame, channel.frames = struct.array("channel_frame_t", frames, bus.FRAME), len(frames)
        channel.stride = STRIDE
        channel.tau_m, channel.asked = struct.doubles(np.zeros(self.count)), struct.doubles(asked)
        channel.health = struct.array("lever_health_t", health, health.dtype)
        channel.estimate = struct.array("lever_estimate_t", estimate, estimate.dtype)
        lib.channel_run(channel, estimator.pointer, 0, self.count)
        return Record(health, estimate, asked, tuple(channel.result), len(frames), channel.unanswered)
