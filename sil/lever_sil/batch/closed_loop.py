"""A lever of plant.py that the firmware moves by its own torque: fast/c/loop.h."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.firmware.library import struct_dtype
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..fast.closed_loop import command_structs, field_of
from ..fast.library import Struct, lib
from .motions import PERIOD, STRIDE
from .plant import BatchPlant, Lanes

MOTOR_LAG = 2e-3
"""Time constant with which the motor's torque follows the firmware's [s]."""


class LaneLoop:
    """One run of a lever, its sensors and the firmware."""

    def __init__(self, given: Lanes, offsets: Mapping[str, FloatArray], config: Config, health_stride: int) -> None:
        """Prepare it.

        `given` has one lane; `offsets` are added to theta, theta_dot, tau_m and z_ddot, a value a sample. Health is
        kept of every `health_stride`-th sample.
        """
        self._estimator, self._plant = Estimator(config), BatchPlant(given)
        self.count = self._plant.count
        self.struct = Struct("loop_t")
        self.signals = {
            "theta": self._plant.theta[:, 0], "theta_dot": self._plant.theta_dot[:, 0],
            "tau_m": np.zeros(self.count), "z_ddot": given.z_ddot[:, 0],
        }  # fmt: skip
        """True ones: torque that acts [N m], and those of Lanes."""
        self.asked = np.zeros(self.count)
        """The torque that the firmware asks of the motor, at every sample [N m]."""
        self.estimate = np.zeros((self.count - 1) // STRIDE + 1, struct_dtype("lever_estimate_t"))
        """At every STRIDE-th sample."""
        self.health = np.zeros((self.count - 1) // health_stride + 1, struct_dtype("lever_health_t"))
        loop = self.struct.pointer
        loop.count, loop.period_us, loop.most_unanswered = self.count, round(PERIOD * 1e6), 0xFFFFFFFF
        loop.lanes, loop.motor_decay = self._plant.struct.pointer, math.exp(-PERIOD / MOTOR_LAG)
        loop.stride, loop.health_stride = STRIDE, health_stride
        for name, values in self.signals.items():
            self.add_sensor(name, values, offsets[name])
        self.lose(np.zeros(self.count), np.zeros(self.count))
        loop.estimate = self.struct.array("struct lever_estimate", self.estimate, self.estimate.dtype)
        loop.health = self.struct.array("struct lever_health", self.health, self.health.dtype)
        loop.asked_of_motor = self.struct.doubles(self.asked)

    def add_sensor(self, name: str, true: FloatArray, offsets: FloatArray) -> None:
        """Have a sensor of a signal."""
        index = getattr(lib, f"LOOP_{name.upper()}")
        sensor = self.struct.pointer.sensor[index]
        sensor.gain, sensor.offset, sensor.field = 1.0, self.struct.doubles(offsets), field_of(name)
        self.struct.pointer.signal[index] = self.struct.doubles(true)

    def lose(self, lever: NDArray[Any], base: NDArray[Any]) -> None:
        """Say of each sample whether its LEVER_SAMPLE never comes, and whether none of it does."""
        loop = self.struct.pointer
        loop.no_lever, loop.no_base = (self.struct.array("uint8_t", each, np.uint8) for each in (lever, base))

    def command(self, samples: NDArray[np.intp], values: Sequence[Mapping[str, float]]) -> None:
        """Have a COMMAND before each of these samples."""
        loop = self.struct.pointer
        loop.commands, loop.command_sample = len(samples), self.struct.array("uint32_t", samples, np.uint32)
        loop.command = self.struct.keep(command_structs(values))

    def advance(self, until: int) -> None:
        """Go on to a sample."""
        lib.loop_advance(self.struct.pointer, self._estimator.pointer, until)
