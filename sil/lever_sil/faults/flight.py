"""A pilot whose lever the firmware dithers by CAN: what is true, and what the firmware makes of what arrives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..batch.closed_loop import LaneLoop
from ..batch.motions import PERIOD, Motion, lanes, stream, truth
from ..batch.plant import Lanes, grip_force
from ..batch.sensors import offsets
from ..fast.library import lib
from . import bus, readings
from .bus import Bus, Interval
from .readings import Readings

DITHER = 0.3
"""rms that COMMANDs ask for [N m]."""
FREEZE = 12.0
"""From here on the parameters are held in flights that are frozen [s]."""


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
        self.offsets = offsets(seed, self.count)
        self.truth = {name: values[:, 0] for name, values in truth(self.lanes).items()}

    @cached_property
    def grip_force(self) -> FloatArray:
        """Of the hand on the lever in a flight without faults [N]; the motor does the same in all such."""
        flight = self._closed(None, Config(), *self._right(False))
        theta, theta_dot = (flight.signals[name][:, None] for name in ("theta", "theta_dot"))
        force: FloatArray = grip_force(self.lanes, theta, theta_dot)[:, 0]
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
        flight = self._closed(self.grip_force if grip else None, config, sent, read)
        loop = flight.struct.pointer
        return Record(flight.health, flight.estimate, flight.asked, tuple(loop.result), loop.arrivals, loop.unanswered)

    def _right(self, grip: bool) -> tuple[Bus, Readings]:
        random = stream("faults", self.seed)
        return Bus(self.count, PERIOD, grip, DITHER, random), Readings.right(self.count, PERIOD, random)

    def _closed(self, force: FloatArray | None, config: Config, sent: Bus, read: Readings) -> LaneLoop:
        flight = LaneLoop(self.lanes, self.offsets, config, health_stride=1)
        if force is not None:
            flight.add_sensor("grip_force", force, self.offsets["grip_force"])
        struct, loop = flight.struct, flight.struct.pointer
        for name, reading in read.of.items():
            sensor = loop.sensor[getattr(lib, f"LOOP_{name.upper()}")]
            sensor.source = struct.array("int64_t", reading.source, np.int64)
            sensor.factor, sensor.error = struct.doubles(reading.factor), struct.doubles(reading.offset)
        loop.time_us = struct.array("uint32_t", read.time_us & 0xFFFFFFFF, np.uint32)
        frames = sent.delivered()
        loop.arrival, loop.arrivals = struct.array("loop_arrival_t", frames, bus.FRAME), len(frames)
        flight.advance(self.count)
        return flight
