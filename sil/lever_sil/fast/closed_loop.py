"""A scenario against the firmware in this process, by c/loop.h."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from lever_cdkf.can import codec
from lever_cdkf.can.commander import Commander
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import AircraftResponse
from lever_cdkf.firmware.estimator import Estimator, Recorder, make_command
from lever_cdkf.firmware.library import ffi, struct_dtype
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..aircraft.flight import Flight
from ..scenarios import inputs as scenario_inputs
from ..scenarios.inputs import OF_LEVER, Inputs
from ..scenarios.scenario import Scenario
from . import aircraft, plants
from .library import Struct, lib

STRIDE = 0.02
"""Time between two estimates that are kept [s]."""

_MESSAGES = {
    "grip_force": "GRIP_SAMPLE", "z_ddot": "BASE_SAMPLE", "torque": "MOTOR_COMMAND", "correction": "CORRECTION"
}  # fmt: skip
"""That carry what LEVER_SAMPLE does not."""
_FRAMES_AT_ONCE = 1 << 17


@dataclass(frozen=True)
class BusFrames:
    """Frames of 8 bytes in the order in which they were on the bus; arrays of equal length."""

    identifier: NDArray[np.uint16] = field(default_factory=lambda: np.empty(0, np.uint16))
    sample: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    data: NDArray[np.uint8] = field(default_factory=lambda: np.empty((0, 8), np.uint8))
    """(count, 8)."""


class Loop:
    """A run under way."""

    def __init__(
        self, scenario: Scenario, inputs: Inputs, *, by_frames: bool, every: int, estimator: Estimator | None = None
    ) -> None:
        """Prepare a run.

        `every`: of how many samples one has its estimate kept. `estimator`: goes on from where it is, without the reset
        that a run begins with.
        """
        if not plants.has(inputs.truth):
            raise LeverError(f"a pilot of model {inputs.truth.model} runs in Python only: use run.runner.simulate()")
        self._scenario, self._inputs = scenario, inputs
        self._estimator, self._goes_on = estimator or Estimator(scenario.config), estimator is not None
        self.struct = Struct("loop_t")
        count = len(inputs.time)
        loop = self.struct.pointer
        loop.count, loop.period_us = count, round(scenario.period * 1e6)
        loop.stride = loop.health_stride = every
        loop.by_frames, loop.has_grip = by_frames, scenario.sensors.grip_force is not None
        loop.most_unanswered = 0xFFFFFFFF
        self.correction = np.zeros(count)
        """Of the lever's angle, as put out [rad]; 0 without an aircraft."""
        self.signals = {name: np.empty(count) for name in OF_LEVER if name != "grip_force" or loop.has_grip}
        conditions, flight = scenario_inputs.conditions(scenario, inputs), scenario_inputs.flight(scenario, inputs)
        if flight is not None:
            self.signals["z_ddot"] = inputs.sensed
            conditions = replace(conditions, z_ddot=self._fill_cabin(flight))
        plants.fill(self.struct, loop.plant, inputs.truth, conditions)
        loop.plant.has_grip_force = loop.has_grip
        for name, signal in self.signals.items():
            index = getattr(lib, f"LOOP_{name.upper()}")
            self._fill_sensor(loop.sensor[index], name)
            loop.signal[index] = self.struct.doubles(signal)
        loop.sensor[lib.LOOP_Z_DDOT].field = field_of("z_ddot")
        self._fill_columns()
        self._fill_commands()
        rows = (count - 1) // every + 1
        self._estimates = np.zeros(rows, struct_dtype("lever_estimate_t"))
        self._healths = np.zeros(rows, struct_dtype("lever_health_t"))
        loop.estimate = self.struct.array("struct lever_estimate", self._estimates, self._estimates.dtype)
        loop.health = self.struct.array("struct lever_health", self._healths, self._healths.dtype)

    def _fill_cabin(self, flight: Flight) -> FloatArray:
        """Put in a helicopter in hover; return z_ddot as its pilot feels it, of which the first value is known."""
        inputs, struct, cabin = self._inputs, self.struct, self.struct.pointer.cabin
        felt = inputs.z_ddot.copy()
        cabin.exists, cabin.period, cabin.rest = True, self._scenario.period, float(inputs.truth.rest[0])
        cabin.outside, cabin.felt = plants.outside(inputs.truth), struct.doubles(felt)
        cabin.seat = struct.doubles(inputs.z_ddot)
        aircraft.fill(struct, cabin.aircraft, flight, self.correction)
        return felt

    def _fill_sensor(self, given: Any, name: str) -> None:
        readings = scenario_inputs.readings(self._scenario, self._inputs, name)
        given.gain = 1.0 + readings.sensor.gain_error
        given.whole, given.part = readings.sensor.lag(self._scenario.period)
        given.offset = self.struct.doubles(readings.offsets)
        given.field = field_of(name)
        if readings.corruption is not None:
            given.source = self.struct.array("int64_t", readings.corruption.source, np.int64)
            given.factor = self.struct.doubles(readings.corruption.factor)
            given.error = self.struct.doubles(readings.corruption.offset)

    def _fill_columns(self) -> None:
        loop, inputs = self.struct.pointer, self._inputs
        loop.torque = self.struct.doubles(inputs.torque)
        if not loop.cabin.exists:
            loop.base = self.struct.doubles(inputs.base)
        loop.torque_field, loop.correction_field = field_of("torque"), field_of("correction")
        loop.no_lever, loop.no_base = (
            self.struct.array("uint8_t", inputs.missing[frame], np.uint8) for frame in ("lever_frame", "base_frame")
        )

    def _fill_commands(self) -> None:
        loop = self.struct.pointer
        commands = scenario_inputs.commands(self._scenario, self._inputs.time)
        samples = sorted(commands)
        values = [commands[sample] for sample in samples]
        if self._goes_on:
            values[0] = {**values[0], "request": "none"}
        loop.commands = len(samples)
        loop.command_sample = self.struct.array("uint32_t", np.array(samples), np.uint32)
        if loop.by_frames:
            loop.command_frame = self.struct.keep(_command_frames(values))
        else:
            loop.command = self.struct.keep(command_structs(values))

    def watch(self, aircraft: AircraftResponse | None) -> NDArray[Any]:
        """Have the firmware watch the loop with this aircraft, where there is one.

        Return what is kept of that: lever_stability_t.
        """
        self._estimator.watch(aircraft)
        kept = np.zeros(len(self._healths), struct_dtype("lever_stability_t"))
        self.struct.pointer.stability = self.struct.array("struct lever_stability", kept, kept.dtype)
        return kept

    def gear(self, gearing: FloatArray) -> None:
        """Of an aircraft, at every sample [1], in place of that of the scenario."""
        self.struct.pointer.cabin.aircraft.gearing = self.struct.doubles(gearing)

    def give_time(self, time_us: NDArray[np.uint32]) -> None:
        """Of all samples, by structs [us], in place of that which is."""
        self.struct.pointer.time_us = self.struct.array("uint32_t", time_us, np.uint32)

    def advance(self, until: int) -> int:
        """Go on to a sample; return the one that it came to."""
        return lib.loop_advance(self.struct.pointer, self._estimator.pointer, until)  # type: ignore[no-any-return]

    def keep_frames(self) -> None:
        """Have advance() stop where it has filled BusFrames."""
        loop, room = self.struct.pointer, _FRAMES_AT_ONCE
        self._traffic = BusFrames(np.empty(room, np.uint16), np.empty(room, np.uint32), np.empty((room, 8), np.uint8))
        loop.frame_room = room
        loop.frame_id = self.struct.array("uint16_t", self._traffic.identifier, np.uint16)
        loop.frame_sample = self.struct.array("uint32_t", self._traffic.sample, np.uint32)
        loop.frame_data = ffi.cast("uint8_t (*)[8]", self.struct.array("uint8_t", self._traffic.data, np.uint8))

    def send_snapshots(self, period: float) -> None:
        """By frames: also sends the state of the firmware each `period` seconds."""
        recorder = Recorder(self._estimator, period)
        self.struct.pointer.recorder = self.struct.keep(recorder.pointer)

    def take_frames(self) -> BusFrames:
        """Return those since they were taken last."""
        loop, traffic = self.struct.pointer, self._traffic
        taken = slice(0, loop.frames)
        loop.frames = 0
        return BusFrames(traffic.identifier[taken].copy(), traffic.sample[taken].copy(), traffic.data[taken].copy())

    def check(self) -> None:
        """Raise LeverError when the firmware has refused a command."""
        loop = self.struct.pointer
        if loop.refused:
            raise LeverError(f"the estimator refuses COMMAND at {(loop.sample - 1) * self._scenario.period:g} s")

    @property
    def outputs(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """What is kept of the firmware: arrays of lever_estimate_t and lever_health_t."""
        return self._estimates, self._healths


def available(name: str, values: FloatArray) -> FloatArray:
    """Return the readings of the sensor `name`, NaN where they are beyond the range of their frame."""
    field = field_of(name)
    return np.where(np.abs(values / field["step"]) < field["most"] + 0.5, values, np.nan)


@cache
def field_of(name: str) -> dict[str, float]:
    """Return the loop_field_t of a sensor's signal, of torque or of correction."""
    signal = codec.message(_MESSAGES.get(name, "LEVER_SAMPLE")).get_signal_by_name(name)
    return {"step": float(signal.scale), "most": 2.0 ** (signal.length - 1) - 1.0}


def command_structs(commands: Sequence[Mapping[str, codec.Value]]) -> Any:
    """Return the command structs of type lever_command_t[]."""
    structs: list[Any] = [make_command(**values) for values in commands]  # type: ignore[arg-type]
    return ffi.new("lever_command_t[]", [each[0] for each in structs])


def _command_frames(commands: Sequence[Mapping[str, codec.Value]]) -> Any:
    """Return the command frames of type lever_frame_t[]."""
    sent: list[dict[str, Any]] = []
    commander = Commander()
    for values in commands:
        commander.send(values, lambda identifier, data: sent.append({"id": identifier, "length": 8, "data": data}))
    return ffi.new("lever_frame_t[]", sent)
