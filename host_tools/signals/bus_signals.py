"""Signals out of recorded CAN frames, decoded by cantools with whatever database a user has."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cantools.database
import numpy as np
from cantools.database.can import Database, Message
from cantools.database.can import Signal as Field
from cantools.database.namedsignalvalue import NamedSignalValue
from e2e.p01 import e2e_p01_check
from e2e.p02 import e2e_p02_check
from e2e.p05 import e2e_p05_check

from ..can.bulk import ERROR, EXTENDED, FD, REMOTE, Frames
from ..can.logs import LogError, Recording
from ..errors import LeverError
from .mapping import Protection
from .recorded import Signal

_NO_VALUE = re.compile(r"sna$|not.?avail|invalid|error|fault|undefined|no.?value", re.IGNORECASE)
"""Names of codes that stand for no value."""
_CHECKS: dict[int, Callable[[bytearray, Any], bool]] = {
    1: lambda data, identifier: e2e_p01_check(data, identifier),
    2: lambda data, identifiers: e2e_p02_check(bytes(data), bytes(identifiers), length=0),
    5: lambda data, identifier: e2e_p05_check(bytes(data), identifier),
}


def load_database(path: str | Path) -> Database:
    """A DBC, or what else cantools reads. Raises LeverError."""
    try:
        loaded = cantools.database.load_file(path, strict=False)
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}") from None
    except Exception as error:  # each format has its own
        raise LeverError(f"{path}: no database of CAN messages that cantools reads: {error}") from None
    if not isinstance(loaded, Database) or not loaded.messages:
        raise LeverError(f"{path}: it describes no CAN message")
    return loaded


def find(database: Database, name: str, where: str) -> tuple[Message, Field]:
    """Message and signal by MESSAGE.SIGNAL, or SIGNAL where it is the only one. Raises LeverError."""
    messages = {message.name: message for message in database.messages}
    message_name, dot, signal_name = name.rpartition(".")
    if dot and message_name not in messages:
        raise LeverError(f"{where}: {name}: no message {message_name}{_near(message_name, messages)}")
    among = [messages[message_name]] if dot else database.messages
    matches = [(message, each) for message in among for each in message.signals if each.name == signal_name]
    if len(matches) == 1:
        return matches[0]
    if matches:
        choices = ", ".join(f"{message.name}.{signal_name}" for message, _ in matches)
        raise LeverError(f"{where}: {signal_name} is in several messages: {choices}")
    names = {each.name for message in among for each in message.signals}
    raise LeverError(f"{where}: no signal {name}{_near(signal_name, names)}")


def _near(name: str, names: Iterable[str]) -> str:
    import difflib

    lower = {each.lower(): each for each in names}
    near = difflib.get_close_matches(name.lower(), lower, n=3, cutoff=0.5)
    return f"; near to it: {', '.join(lower[each] for each in near)}" if near else ""


@dataclass
class Counts:
    """What was found in the frames of one message."""

    frames: int = 0
    corrupt: int = 0
    """By their CRC; left out."""
    lost: int = 0
    """By their counter."""
    repeated: int = 0
    """By their counter; left out."""
    undecoded: int = 0
    """That do not fit the database; left out."""


@dataclass
class Received:
    """Frames of one message on one bus."""

    time_us: list[int] = field(default_factory=list)
    data: list[bytes] = field(default_factory=list)


class BusSignals:
    """The signals that are asked for, out of logs."""

    def __init__(self, database: Database, wanted: Iterable[Message], protected: dict[str, Protection]) -> None:
        self.counts: dict[str, Counts] = {}
        """By message."""
        self._messages = {(each.frame_id, each.is_extended_frame): each for each in wanted}
        self._protected = protected
        self._frames: dict[tuple[str, str], Received] = defaultdict(Received)  # by message and bus
        self._done: dict[tuple[str, str], list[tuple[int, dict[str, Any]]]] = {}
        self._fd: set[str] = set()
        if unknown := sorted(set(protected) - {each.name for each in database.messages}):
            raise LeverError(f"the mapping protects {', '.join(unknown)}, which is no message of the database")

    def add(self, frames: Frames, recording: Recording) -> None:
        """Keeps what is needed of further frames."""
        names = recording.buses.names()
        for (identifier, extended), message in self._messages.items():
            same = (frames["id"] == identifier) & ((frames["flags"] & EXTENDED != 0) == extended)
            same &= frames["flags"] & (REMOTE | ERROR) == 0
            of_fd = frames["flags"] & FD != 0
            if (same & of_fd).any():
                self._fd.add(message.name)
            chosen = frames[same & ~of_fd]
            for bus in np.unique(chosen["bus"]):
                kept = chosen[chosen["bus"] == bus]
                received = self._frames[message.name, names[bus]]
                received.time_us += kept["time_us"].tolist()
                raw = np.ascontiguousarray(kept["data"]).tobytes()
                received.data += [raw[8 * k : 8 * k + length] for k, length in enumerate(kept["length"].tolist())]

    def signals(
        self, message: Message, names: Iterable[str], channel: str | None, log: str
    ) -> tuple[dict[str, Signal], str]:
        """Signals of a message, and on which bus: if not given, the only one that has it. Raises LogError."""
        bus = self._bus(message, channel, log)
        decoded = self._decoded(message, bus)
        time = np.array([time_us for time_us, _ in decoded], np.float64) * 1e-6
        signals = {}
        for name in names:
            each = message.get_signal_by_name(name)
            values = np.array([number(each, values.get(name)) for _, values in decoded], np.float64)
            there = np.array([name in values for _, values in decoded], np.bool_)  # of a multiplexed one, not always
            words = each.comment or ""
            signals[name] = Signal(f"{message.name}.{name}", time[there], values[there], each.unit or "", words)
        return signals, bus

    def buses(self, message: Message) -> list[str]:
        """Which buses have it."""
        return sorted(bus for name, bus in self._frames if name == message.name)

    def _bus(self, message: Message, channel: str | None, log: str) -> str:
        buses = self.buses(message)
        if channel is not None and channel in buses:
            return channel
        if channel is None and len(buses) == 1:
            return buses[0]
        what = f"{message.name} ({message.frame_id:#x})"
        if len(buses) > 1 or (buses and channel is not None):
            missed = "" if channel is None else f"not on {channel}, but "
            raise LogError(f"{log}: {what} is {missed}on {' and '.join(buses)}: choose with --channel or channel=")
        if message.name in self._fd:
            raise LogError(f"{log}: {what} comes as CAN FD, which is not read here: export it as CSV or MF4 signals")
        raise LogError(f"{log}: no frame of {what} in it")

    def _decoded(self, message: Message, bus: str) -> list[tuple[int, dict[str, Any]]]:
        """Time and fields of each frame that is right."""
        if (message.name, bus) not in self._done:
            self._done[message.name, bus] = self._decode(message, self._frames[message.name, bus])
        return self._done[message.name, bus]

    def _decode(self, message: Message, received: Received) -> list[tuple[int, dict[str, Any]]]:
        counts = self.counts.setdefault(message.name, Counts())
        protection = self._protected.get(message.name)
        check = None if protection is None or protection.profile is None else _CHECKS[protection.profile]
        kept: list[tuple[int, dict[str, Any]]] = []
        last: int | None = None
        counts.frames += len(received.data)
        for time_us, data in zip(received.time_us, received.data, strict=True):
            if check is not None and protection is not None and not check(bytearray(data), protection.data_id):
                counts.corrupt += 1
                continue
            try:
                values: Any = message.decode(data, decode_choices=True, allow_truncated=True)
            except Exception:  # cantools raises what its decoder happens to
                counts.undecoded += 1
                continue
            if protection is not None and protection.counter is not None:
                now = int(values[protection.counter])
                step = 1 if last is None else (now - last) % _turn(message, protection)
                last = now
                counts.lost += max(step - 1, 0)
                counts.repeated += step == 0
                if step == 0:
                    continue
            kept.append((time_us, values))
        return kept


def _turn(message: Message, protection: Protection) -> int:
    """After how many frames the counter is where it was: profile 1 leaves out its last value."""
    assert protection.counter is not None
    return (1 << message.get_signal_by_name(protection.counter).length) - (1 if protection.profile == 1 else 0)


def number(signal: Field, value: Any) -> float:
    """A decoded value; NaN for none, and for a code that stands for none."""
    if isinstance(value, NamedSignalValue):
        code = signal.conversion.raw_to_scaled(value.value, decode_choices=False)
        return float("nan") if _NO_VALUE.search(value.name) else float(code)  # type: ignore[arg-type]
    return float("nan") if value is None else float(value)
