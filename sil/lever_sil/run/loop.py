"""A run in lock-step over any python-can bus: one sample out, one estimate back, whatever time that takes.

An estimate says which sample it belongs to, by the low bits of its time: what answers another one is not taken for this
one's. Dither and mitigation need a COMMAND a second, and get one every KEEP_ALIVE of simulated time.

Everything that does not depend on the estimator (excitation, noise, dropouts, truth) is made beforehand, everything
that is not needed to go on (decoding, statistics, files) is done afterwards, both in whole columns; the loop in between
advances the plant, encodes two frames and waits for STATE_ESTIMATE. Time is the time in the frames, so that a run gives
the same bytes at any speed and on any bus.
"""

from __future__ import annotations

import time as clock
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import can
import numpy as np
from lever_cdkf.can import codec
from lever_cdkf.can.commander import ACCEPTED, SEQUENCE, Commander, refusal, result_of
from lever_cdkf.can.identity import Identity
from lever_cdkf.errors import LeverError, SettingsError
from lever_cdkf.numeric.arrays import FloatArray

from ..aircraft.flight import Flight
from ..fast.closed_loop import BusFrames
from ..plants import sensors
from ..plants.truth import Body
from ..scenarios.inputs import Inputs, conditions, flight, prepare, readings
from ..scenarios.inputs import commands as commands_of
from ..scenarios.scenario import Scenario
from .buslog import Frames

Progress = Callable[[int, int], None]
"""Called now and then with the samples done and the samples in all."""

ANSWER_TIMEOUT = 5.0
"""Longest wait for a STATE_ESTIMATE [s]; a sample that gets none in that time is counted as unanswered."""
FIRST_TIMEOUT = 2.0
"""Longest wait for the first one: the other process may still be starting."""
MOST_UNANSWERED = 20
"""Samples without an answer in a row, after which the estimator is taken to be absent."""

CORRECTION_HOLDS = 0.1
"""Without a sample, a correction that is older [s] counts as none."""

REST = 5.0
"""Sample time [s] after which nothing is left of an earlier torque: twenty time constants of the torque gate's rms."""

_PROGRESS_EVERY = 500


class NoAnswerError(LeverError):
    """No estimator answers on the bus."""


class RefusedError(LeverError):
    """The estimator refuses a COMMAND of the run."""


class _UnrestedError(Exception):
    """A run has ended so recently that its torque, or the sequence of its COMMANDs, reaches into this one."""


@dataclass
class Recording:
    """What a run left behind, in whole columns."""

    scenario: Scenario
    inputs: Inputs
    traffic: BusFrames = field(default_factory=BusFrames)
    theta: FloatArray = field(default_factory=lambda: np.empty(0))
    """True angle of the lever [rad], its rate [rad/s] and the motor's torque [N m] at the samples."""
    theta_dot: FloatArray = field(default_factory=lambda: np.empty(0))
    tau_m: FloatArray = field(default_factory=lambda: np.empty(0))
    unanswered: int = 0
    misplaced: int = 0
    """Estimates that belong to another sample than the one that was to be answered."""
    identity: Identity = field(default_factory=Identity)
    has_aircraft: bool = True
    """Whether the estimator is known to watch the scenario's aircraft, or to watch none where that has none."""

    def frames(self) -> Frames:
        """Return all frames, with the time of their sample."""
        period_us = round(self.scenario.period * 1e6)
        received = np.isin(self.traffic.identifier, list(_from_estimator()))
        time_us = self.traffic.sample.astype(np.int64) * period_us
        return Frames(time_us, self.traffic.identifier, self.traffic.data, received)


@dataclass
class _Tape:
    """A Recording while it is made, in the order in which everything happens."""

    scenario: Scenario
    inputs: Inputs
    identifier: array[int] = field(default_factory=lambda: array("H"))
    sample: array[int] = field(default_factory=lambda: array("L"))
    data: bytearray = field(default_factory=bytearray)
    theta: list[float] = field(default_factory=list)
    theta_dot: list[float] = field(default_factory=list)
    tau_m: list[float] = field(default_factory=list)
    grip_force: list[float] = field(default_factory=list)
    unanswered: int = 0
    misplaced: int = 0
    identity: Identity = field(default_factory=Identity)

    @property
    def z_ddot(self) -> FloatArray:
        """Of the cabin at the accelerometer, as far as it is known [m/s^2]."""
        return self.inputs.sensed

    def finished(self) -> Recording:
        """Return the whole recording."""
        data = np.frombuffer(bytes(self.data), dtype=np.uint8).reshape(-1, 8)
        return Recording(
            self.scenario,
            self.inputs,
            BusFrames(np.array(self.identifier, dtype=np.uint16), np.array(self.sample, dtype=np.uint32), data),
            np.array(self.theta),
            np.array(self.theta_dot),
            np.array(self.tau_m),
            self.unanswered,
            self.misplaced,
            self.identity,
        )


def run(
    scenario: Scenario,
    bus: can.BusABC,
    *,
    realtime: bool = False,
    progress: Progress | None = None,
    commander: Commander | None = None,
) -> Recording:
    """Run `scenario` against the estimator on `bus`, as fast as that answers or paced by the wall clock.

    One that comes from another run rests for REST first, off the record, so that one seed is one run on it, too.

    `commander`: of whoever else sends COMMAND on this bus. Raise NoAnswerError when nobody answers, RefusedError when
    the estimator refuses a COMMAND, and LeverError when it speaks another contract or has other settings.
    """
    inputs, alone = prepare(scenario), commander is None
    commander = commander or Commander()
    tape = _Tape(scenario, inputs)
    try:
        _loop(tape, _Link(bus, tape, commander, must_rest=alone), realtime, progress)
    except _UnrestedError:
        resting = _Tape(scenario, inputs)
        _rest(_Link(bus, resting, commander), scenario, float(inputs.truth.rest[0]))
        tape = _Tape(scenario, inputs, identity=resting.identity)
        _loop(tape, _Link(bus, tape, commander), realtime, progress)
    return tape.finished()


def _rest(link: _Link, scenario: Scenario, theta: float) -> None:
    """Send samples of a lever at rest until the estimator, after a reset, is like a fresh one.

    That is up to a HEALTH, which clears the faults that it has latched.
    """
    send_lever, send_base = link.sender("LEVER_SAMPLE"), link.sender("BASE_SAMPLE")
    encode_lever, encode_base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
    period_us = round(scenario.period * 1e6)
    link.command(0, {"request": "reset", "dither_rms": 0.0})
    for sample in range(round(2.0 * REST / scenario.period)):
        send_lever(sample, encode_lever(sample, theta, 0.0, 0.0))
        send_base(sample, encode_base(sample, 0.0, sample * period_us))
        link.answer(sample)
        if sample * scenario.period >= REST and link.has_health:
            break


class _Link:
    """The estimator at the other end of the bus; records every frame both ways."""

    def __init__(self, bus: can.BusABC, tape: _Tape, commander: Commander, *, must_rest: bool = False) -> None:
        """`must_rest`: what an earlier run has left is an _UnrestedError."""
        self.has_health = False
        """Whether the last answer had a HEALTH in it."""
        self._must_rest = must_rest
        self._bus = bus
        self._tape = tape
        self._commander = commander
        self._period_us = round(tape.scenario.period * 1e6)
        self._estimate = codec.message("STATE_ESTIMATE").frame_id
        self._motor = codec.message("MOTOR_COMMAND").frame_id
        self._acknowledgement = codec.message("COMMAND_ACK").frame_id
        self._identity = codec.message("IDENTITY").frame_id
        self._health = codec.message("HEALTH").frame_id
        self._torque = _signed_field("MOTOR_COMMAND", "torque")
        self._correction = codec.message("CORRECTION").frame_id
        self._angle = _signed_field("CORRECTION", "correction")
        self._correction_time = codec.raw_field("CORRECTION", "time_low")
        self._motor_time = codec.raw_field("MOTOR_COMMAND", "time_low")
        self._estimate_time = codec.raw_field("STATE_ESTIMATE", "time_low")
        self._unanswered_in_a_row = 0
        self._incoming = _from_estimator()

    def sender(self, name: str) -> Callable[[int, bytes], None]:
        """Return a function that sends a frame of the message `name`: called with the sample and the 8 bytes."""
        identifier = codec.message(name).frame_id
        message = can.Message(arbitration_id=identifier, is_extended_id=False, data=bytes(8))
        send, tape = self._bus.send, self._tape

        def send_frame(sample: int, data: bytes) -> None:
            message.data = bytearray(data)
            send(message)
            tape.identifier.append(identifier)
            tape.sample.append(sample)
            tape.data += data

        return send_frame

    def command(self, sample: int, values: Mapping[str, codec.Value]) -> None:
        """Send a COMMAND and wait until it is acknowledged; raise LeverError.

        A run that has just ended may have left the sequence counter anywhere, so the first COMMAND is repeated until it
        is in sequence.
        """
        send = self.sender("COMMAND")
        for _ in range(1 if sample else 16):
            counter = self._commander.send(values, lambda _, data: send(sample, data))
            result = self._acknowledged(sample, counter)
            if result != SEQUENCE:
                break
            if self._must_rest and not sample:
                raise _UnrestedError
        if result not in (ACCEPTED, None):
            raise RefusedError(f"{self._bus.channel_info}: {refusal(str(result))}")

    def _acknowledged(self, sample: int, counter: int) -> str | None:
        """Return what became of a COMMAND; None when that is not said in time."""
        timeout = ANSWER_TIMEOUT if sample else FIRST_TIMEOUT
        while (frame := self._take(sample, timeout)) is not None:
            if frame[0] == self._acknowledgement:
                ack = codec.decode(*frame)[1]
                if ack["command_counter"] == counter:
                    return result_of(ack)
        if not sample:
            raise NoAnswerError(
                f"no COMMAND_ACK on {self._bus.channel_info}: is the firmware, of this version, running there?"
            )
        return None

    def answer(self, sample: int) -> tuple[float, float]:
        """Take what the estimator sends for this sample, up to its STATE_ESTIMATE.

        Return the torque that it asks for and what it adds to the lever's angle.
        """
        time_low = sample * self._period_us & 0xFFFF
        timeout = ANSWER_TIMEOUT if sample else FIRST_TIMEOUT
        torque, correction = 0.0, 0.0
        self.has_health = False
        while (frame := self._take(sample, timeout)) is not None:
            identifier, data = frame
            if identifier == self._motor:
                if self._motor_time(data) == time_low:
                    torque = self._torque(data)
                    if torque != 0.0 and self._must_rest and not sample:
                        raise _UnrestedError
            elif identifier == self._correction:
                if self._correction_time(data) == time_low:
                    correction = self._angle(data)
            elif identifier == self._health:
                self.has_health = True
            elif identifier == self._estimate:
                if self._estimate_time(data) == time_low:
                    self._unanswered_in_a_row = 0
                    return torque, correction
                self._tape.misplaced += 1
        self._miss(sample)
        return torque, correction

    def _take(self, sample: int, timeout: float) -> tuple[int, bytes | bytearray] | None:
        """Return the next frame of the estimator, recorded; None when none comes in time."""
        tape = self._tape
        while (message := self._bus.recv(timeout)) is not None:
            identifier, data = message.arbitration_id, message.data
            if identifier not in self._incoming or len(data) != 8:
                continue  # somebody else's
            tape.identifier.append(identifier)
            tape.sample.append(sample)
            tape.data += data
            if identifier == self._identity:
                tape.identity.take(codec.decode(identifier, data)[1])
                tape.identity.check(f"the estimator on {self._bus.channel_info}")
                self._check_settings()
            return identifier, data
        return None

    def _check_settings(self) -> None:
        """Check that the settings of the bus are the scenario's: no frame carries them.

        Raise SettingsError when they are not.
        """
        scenario, says = self._tape.scenario, self._tape.identity.settings_crc
        if says not in (None, scenario.config.settings_crc):
            raise SettingsError(
                f"the estimator on {self._bus.channel_info} has other settings than the scenario: start it with those "
                "that this command prints with --settings, or give its own here with --settings FILE"
            )

    def _miss(self, sample: int) -> None:
        self._tape.unanswered += 1
        self._unanswered_in_a_row += 1
        if self._unanswered_in_a_row >= MOST_UNANSWERED or not sample:
            raise NoAnswerError(
                f"no STATE_ESTIMATE on {self._bus.channel_info} at sample {sample}: is the firmware running there?"
            )


def _from_estimator() -> frozenset[int]:
    """Return identifier of what an estimator sends."""
    messages = codec.database().messages
    return frozenset(message.frame_id for message in messages if message.senders == ["ESTIMATOR"])


def _signed_field(name: str, signal: str) -> Callable[[bytes | bytearray], float]:
    """Return a fast reader of one signed, scaled field of an 8-byte frame, which is always available."""
    layout = codec.message(name).get_signal_by_name(signal)
    raw, scale, half = codec.raw_field(name, signal), float(layout.scale), 1 << (layout.length - 1)
    return lambda data: ((raw(data) ^ half) - half) * scale


def _loop(tape: _Tape, link: _Link, realtime: bool, progress: Progress | None) -> None:
    """Send the samples, one after the other."""
    scenario, inputs = tape.scenario, tape.inputs
    count = len(inputs.time)
    cabin = flight(scenario, inputs)
    body = inputs.truth.body(conditions(scenario, inputs))
    advance = _advance(body, cabin, inputs)
    commands = commands_of(scenario, inputs.time)
    pace = _pace(scenario.period) if realtime else None
    send_lever, send_base = link.sender("LEVER_SAMPLE"), link.sender("BASE_SAMPLE")
    encode_lever, encode_base = codec.encoder("LEVER_SAMPLE"), codec.encoder("BASE_SAMPLE")
    thetas, theta_dots, torques, forces = tape.theta, tape.theta_dot, tape.tau_m, tape.grip_force
    measure = [_reader_of(tape, name) for name in ("theta", "theta_dot", "tau_m")]
    send_grip = _grip_sender(tape, link)
    no_lever, no_base = inputs.missing["lever_frame"].tolist(), inputs.missing["base_frame"].tolist()
    read_base = inputs.base.tolist().__getitem__ if cabin is None else _reader_of(tape, "z_ddot")
    period_us = round(scenario.period * 1e6)
    command, correction, answered, own_torque, last = 0.0, 0.0, 0, inputs.torque.tolist(), count - 1
    holds = round(CORRECTION_HOLDS / scenario.period)

    for sample in range(count):
        thetas.append(body.theta)
        theta_dots.append(body.theta_dot)
        torques.append(body.tau_m)
        forces.append(body.grip_force)
        if sample in commands:
            link.command(sample, commands[sample])
        if not no_lever[sample]:
            send_lever(sample, encode_lever(sample, *(read(sample) for read in measure)))
        if send_grip is not None:
            send_grip(sample)
        if not no_base[sample]:
            send_base(sample, encode_base(sample, read_base(sample), sample * period_us))
            (command, correction), answered = link.answer(sample), sample
        if sample != last:
            advance(sample, command + own_torque[sample], correction if sample - answered <= holds else 0.0)
        if pace is not None:
            next(pace)
        if progress is not None and sample % _PROGRESS_EVERY == 0:
            progress(sample, count)
    if progress is not None:
        progress(count, count)


def _advance(body: Body, cabin: Flight | None, inputs: Inputs) -> Callable[[int, float, float], None]:
    """Return a function that takes lever and cabin from a sample to the next.

    It does so with the torque [N m] held and what is added to the lever's angle [rad].
    """
    rest = body.theta

    def advance(sample: int, torque: float, correction: float) -> None:
        if cabin is not None:
            inputs.z_ddot[sample + 1] = cabin.advance(body.theta - rest, correction)
            inputs.sensed[sample + 1] = cabin.sensed
        body.advance(torque)

    return advance


def _reader_of(tape: _Tape, name: str) -> Callable[[int], float]:
    """Return the reading of a signal of the lever at a sample, from the history up to it; NaN when invalid."""
    scenario = tape.scenario
    given = readings(scenario, tape.inputs, name)
    reader = _reader(given.sensor, getattr(tape, name), given.offsets.tolist(), scenario.period)
    return reader if given.corruption is None else _corrupted(reader, given.corruption)


def _grip_sender(tape: _Tape, link: _Link) -> Callable[[int], None] | None:
    """Return a function that sends the GRIP_SAMPLE of a sample; None without that sensor."""
    if tape.scenario.sensors.grip_force is None:
        return None
    read, send, encode = _reader_of(tape, "grip_force"), link.sender("GRIP_SAMPLE"), codec.encoder("GRIP_SAMPLE")
    return lambda sample: send(sample, encode(sample, read(sample)))


def _reader(
    sensor: sensors.Sensor, history: Sequence[float] | FloatArray, offsets: list[float], period: float
) -> Callable[[int], float]:
    """Return a sensor of a signal that is known only up to now; as Sensor.measure() otherwise."""
    gain = 1.0 + sensor.gain_error
    whole, part = sensor.lag(period)
    if whole == 0 and part == 0.0:
        return lambda sample: gain * history[sample] + offsets[sample]

    def delayed(sample: int) -> float:
        newer, older = history[max(sample - whole, 0)], history[max(sample - whole - 1, 0)]
        return gain * (newer + part * (older - newer)) + offsets[sample]

    return delayed


def _corrupted(reader: Callable[[int], float], corruption: sensors.Corruption) -> Callable[[int], float]:
    """Return what `reader` reads, with the faults in it; as Corruption.of() otherwise."""
    source, factor, offset = (column.tolist() for column in (corruption.source, corruption.factor, corruption.offset))
    return lambda sample: factor[sample] * reader(source[sample]) + offset[sample]


def _pace(period: float) -> Iterator[None]:
    """Wait, each time the generator is advanced, until that many periods have passed on the wall clock."""
    due = clock.perf_counter()
    while True:
        due += period
        remaining = due - clock.perf_counter()
        if remaining > 0.0:
            clock.sleep(remaining)
        yield
