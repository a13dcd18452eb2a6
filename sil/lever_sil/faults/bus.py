"""What arrives at the firmware: frames as they are sent, and what becomes of them on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from e2e.p02 import e2e_p02_protect
from lever_cdkf.can import codec
from lever_cdkf.can.commander import KEEP
from lever_cdkf.firmware.library import struct_dtype
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..fast.library import lib

Indices = NDArray[np.intp]
Interval = tuple[float, float]

FRAME = struct_dtype("loop_arrival_t")
SAMPLES = ("LEVER_SAMPLE", "GRIP_SAMPLE", "BASE_SAMPLE")
"""Messages of every sample, in the order in which they are sent."""
KEEP_ALIVE = 250
"""Samples between two COMMANDs."""
EXTENDED, REMOTE, ERROR = 1 << 31, 1 << 30, 1 << 29
"""How SocketCAN marks frames in their identifiers, which is what a port hands on that forgets to look."""
FULL_LOAD = 8
"""Frames of 8 bytes in a millisecond at 1 Mbit/s."""

_PLACE = {"COMMAND": 0.05, "LEVER_SAMPLE": 0.1, "GRIP_SAMPLE": 0.2, "BASE_SAMPLE": 0.3}
"""Of a message among those of a sample."""


def command(counter: int, **values: codec.Value) -> bytes:
    """Return a COMMAND that changes these values only."""
    return codec.encode("COMMAND", counter, {"request": "none", **KEEP, **values})


def unknown_command(counter: int) -> bytes:
    """Return a COMMAND for a model that is not there."""
    model = codec.message("COMMAND").get_signal_by_name("model")
    word = int.from_bytes(command(counter), "little") & ~(0xF << model.start) | 9 << model.start
    frame = bytearray(word.to_bytes(8, "little"))
    e2e_p02_protect(frame, codec.data_ids("COMMAND"), increment_counter=False)
    return bytes(frame)


class Bus:
    """Frames to the firmware; a fault changes them before they are delivered."""

    def __init__(self, count: int, period: float, grip: bool, dither: float, random: np.random.Generator) -> None:
        """As they should be: `count` samples, with or without GRIP_SAMPLE, and COMMANDs that ask for dither [N m]."""
        self.count = count
        self.period = period
        self.dither = dither
        self.random = random
        self.frames = np.zeros(0, FRAME)
        self.order: FloatArray = np.zeros(0)
        """When each arrives [samples]; the fraction says in which order within a sample."""
        at = np.arange(count, dtype=np.intp)
        for name in SAMPLES if grip else (SAMPLES[0], SAMPLES[2]):
            frames = np.zeros(count, FRAME)
            frames["content"], frames["id"] = getattr(lib, f"LOOP_{name}"), codec.message(name).frame_id
            frames["data_id"], frames["counter"], frames["length"] = codec.data_ids(name)[0], at & 15, 8
            frames["of"] = at
            self.add(frames, at + _PLACE[name])
        data = [command(i, dither_rms=dither) for i in range(16)]
        sent = np.arange(0, count, KEEP_ALIVE)
        self.add_other("COMMAND", [data[i & 15] for i in range(len(sent))], sent + _PLACE["COMMAND"])

    def add(self, frames: NDArray[np.void], order: NDArray[np.floating[Any]]) -> None:
        """Further frames."""
        self.frames, self.order = np.concatenate((self.frames, frames)), np.concatenate((self.order, order))

    def add_other(
        self, identifier: str | Sequence[int], data: Sequence[bytes], order: NDArray[np.floating[Any]]
    ) -> None:
        """Frames with data of their own: of a message by name, or by their identifiers."""
        frames = np.zeros(len(data), FRAME)
        frames["content"], frames["length"] = lib.LOOP_OTHER, 8
        frames["id"] = codec.message(identifier).frame_id if isinstance(identifier, str) else identifier
        frames["of"], frames["change"] = order.astype(np.int64), np.frombuffer(b"".join(data), np.uint8).reshape(-1, 8)
        self.add(frames, order)

    def samples(self, time: Interval) -> Indices:
        """Return those in a time [s]."""
        first, last = (min(self.count, round(moment / self.period)) for moment in time)
        return np.arange(first, last)

    def sent(self, messages: str | Sequence[str], time: Interval) -> Indices:
        """Return indices of the frames of messages that are sent in a time [s]."""
        names = (messages,) if isinstance(messages, str) else messages
        identifiers = [codec.message(name).frame_id for name in names]
        moment = self.frames["of"] * self.period
        own = np.isin(self.frames["id"], identifiers) & (moment >= time[0]) & (moment < time[1])
        return np.flatnonzero(own)

    def lose(self, which: Indices) -> None:
        """Drop these frames: they never arrive."""
        self.frames, self.order = np.delete(self.frames, which), np.delete(self.order, which)

    def delivered(self) -> NDArray[np.void]:
        """Return all in the order in which they arrive."""
        arrives = np.argsort(self.order, kind="stable")
        frames, at = self.frames[arrives], np.floor(self.order[arrives])
        frames["at"] = at
        return frames[at < self.count]


Fault = Callable[[Bus, Interval], None]
"""What happens to the frames of a bus in a time [s]."""


def nothing(bus: Bus, time: Interval) -> None:
    """As it should be."""


def freeze(bus: Bus, time: float) -> None:
    """Let the COMMANDs from a time [s] on also ask to freeze the parameters."""
    for number, index in enumerate(bus.sent("COMMAND", (0.0, np.inf))):
        if bus.frames["of"][index] * bus.period >= time:
            data = command(number & 15, request="freeze", dither_rms=bus.dither)
            bus.frames["change"][index] = np.frombuffer(data, np.uint8)


# --- frames that are damaged -----------------------------------------------------------------------------------------


def flipped(message: str, byte: int) -> Fault:
    """Flip one bit of a byte in every tenth frame, or in every COMMAND."""

    def spoil(bus: Bus, time: Interval) -> None:
        hit = bus.sent(message, time)[:: 1 if message == "COMMAND" else 10]
        bus.frames["change"][hit, byte] ^= (1 << bus.random.integers(0, 8, len(hit))).astype(np.uint8)

    return spoil


def wrong_crc(message: str) -> Fault:
    """Return the fault that inverts the CRC byte of every frame of a message."""

    def spoil(bus: Bus, time: Interval) -> None:
        bus.frames["change"][bus.sent(message, time), 0] ^= 0xFF

    return spoil


def masquerade(message: str) -> Fault:
    """Send the identifier of this message with the CRC of another."""

    def spoil(bus: Bus, time: Interval) -> None:
        bus.frames["data_id"][bus.sent(message, time)] = codec.data_ids("HEALTH")[0]

    return spoil


def short(message: str, length: int) -> Fault:
    """Give the frame this length."""

    def spoil(bus: Bus, time: Interval) -> None:
        bus.frames["length"][bus.sent(message, time)] = length

    return spoil


def marked(message: str, mark: int) -> Fault:
    """Have another node send frames of the same identifier that are extended, remote or error frames."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(message, time)
        frames = bus.frames[at].copy()
        frames["id"] |= np.uint32(mark)
        frames["change"][:, 2:] ^= bus.random.integers(0, 256, (len(at), 6), np.uint8)
        bus.add(frames, bus.order[at] - 0.01)

    return spoil


# --- counters --------------------------------------------------------------------------------------------------------


def repeated(message: str) -> Fault:
    """Have each frame come twice."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(message, time)
        bus.add(bus.frames[at], bus.order[at] + 0.01)

    return spoil


def counting(messages: str | Sequence[str], count: Callable[[Indices], Indices]) -> Fault:
    """Make the counter from the number of the sample."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(messages, time)
        bus.frames["counter"][at] = count(bus.frames["of"][at].astype(np.intp)) & 15

    return spoil


def commands(data: Callable[[int], bytes], every: int = KEEP_ALIVE, usual: bool = False) -> Fault:
    """COMMANDs of other content, each made from its number; beside the `usual` ones or instead of them."""

    def spoil(bus: Bus, time: Interval) -> None:
        if not usual:
            bus.lose(bus.sent("COMMAND", time))
        samples = bus.samples(time)[::every]
        payloads = {i & 15: data(i & 15) for i in range(min(16, len(samples)))}
        bus.add_other("COMMAND", [payloads[i & 15] for i in range(len(samples))], samples + 0.06)

    return spoil


def hanging_command() -> Fault:
    """Repeat the last COMMAND again and again, as a mailbox does that nobody writes to any more."""

    def spoil(bus: Bus, time: Interval) -> None:
        later = bus.sent("COMMAND", time)
        bus.frames["change"][later] = bus.frames["change"][bus.sent("COMMAND", (0.0, time[0]))[-1]]

    return spoil


def flood(values: Sequence[Mapping[str, codec.Value]], last: Mapping[str, codec.Value], each: int = 1) -> Fault:
    """Send a new COMMAND in each sample, or several, which take turns; then one that sets things right again."""

    def spoil(bus: Bus, time: Interval) -> None:
        bus.lose(bus.sent("COMMAND", time))
        samples = np.repeat(bus.samples(time), each)
        usual = bus.sent("COMMAND", (0.0, time[0]))
        first = len(usual)  # their counter goes on
        payloads: dict[tuple[int, int], bytes] = {}
        data = []
        for i in range(len(samples)):
            key = (first + i) & 15, i % len(values)
            if key not in payloads:
                payloads[key] = command(key[0], **values[key[1]])
            data.append(payloads[key])
        bus.add_other("COMMAND", data, samples + 0.06 + 0.001 * (np.arange(len(samples)) % each))
        later = bus.sent("COMMAND", (time[1], np.inf))
        counter = first + len(samples)
        rest = [command(counter + i, **({} if i else last), dither_rms=0.3) for i in range(len(later))]
        if rest:
            bus.frames["change"][later] = np.frombuffer(b"".join(rest), np.uint8).reshape(-1, 8)

    return spoil


# --- frames that are lost, late or in another order ------------------------------------------------------------------


def lost(messages: str | Sequence[str], share: float) -> Fault:
    """Lose this share of the frames of a message at random."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(messages, time)
        bus.lose(at[bus.random.random(len(at)) < share])

    return spoil


def samples_lost(share: float) -> Fault:
    """Lose all messages of a sample, at random."""

    def spoil(bus: Bus, time: Interval) -> None:
        gone = bus.random.random(bus.count) < share
        at = bus.sent(SAMPLES, time)
        bus.lose(at[gone[bus.frames["of"][at]]])

    return spoil


def bursts(messages: str | Sequence[str], length: float, every: float) -> Fault:
    """Nothing of it arrives for a while [s], again and again."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(messages, time)
        since = (bus.frames["of"][at] * bus.period - time[0]) % every
        bus.lose(at[since < length])

    return spoil


def late(messages: str | Sequence[str], samples: float, every: int = 1) -> Fault:
    """By so many samples, every so many-th frame."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(messages, time)
        bus.order[at[bus.frames["of"][at] % every == 0]] += samples

    return spoil


def stale(message: str) -> Fault:
    """Count on, but send the same content."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.sent(message, time)
        bus.frames["of"][at] = bus.frames["of"][at][0]

    return spoil


# --- other senders ---------------------------------------------------------------------------------------------------


def foreign_load() -> Fault:
    """Send frames of other identifiers, as many as the bus can carry.

    Among them are those that the firmware itself sends.
    """

    def spoil(bus: Bus, time: Interval) -> None:
        inputs = [codec.message(name).frame_id for name in (*SAMPLES, "COMMAND", "IDENTITY")]
        others = np.setdiff1d(np.arange(0x7F0), inputs)
        at = np.repeat(bus.samples(time), FULL_LOAD)
        data = bus.random.integers(0, 256, (len(at), 8), np.uint8)
        order = at + bus.random.random(len(at))
        bus.add_other(bus.random.choice(others, len(at)).tolist(), [bytes(row) for row in data], order)

    return spoil


def babble(every: int) -> Fault:
    """Have another node send random data with the identifiers of our inputs."""

    def spoil(bus: Bus, time: Interval) -> None:
        inputs = [codec.message(name).frame_id for name in (*SAMPLES, "COMMAND")]
        at = bus.samples(time)[::every]
        data = bus.random.integers(0, 256, (len(at), 8), np.uint8)
        order = at + bus.random.random(len(at))
        bus.add_other(bus.random.choice(inputs, len(at)).tolist(), [bytes(row) for row in data], order)

    return spoil


def duplicate() -> Fault:
    """Have a second estimator send its IDENTITY each second."""

    def spoil(bus: Bus, time: Interval) -> None:
        at = bus.samples(time)[:: round(1.0 / bus.period)]
        content = {"page": 0, "firmware_major": 0, "firmware_minor": 0, "firmware_patch": 0, "contract": 0}
        bus.add_other("IDENTITY", [codec.encode("IDENTITY", i, content) for i in range(len(at))], at + 0.5)

    return spoil
