"""Signals out of recorded CAN frames, decoded by cantools with whatever database a user has."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

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
from ..results.summary import MessageCounts
from ..text.suggestions import nearest_names
from .mapping import Protection
from .recorded import Signal
from .text_table import UTF_8, encoding_of

_NO_VALUE = re.compile(r"sna$|not.?avail|invalid|error|fault|undefined|no.?value", re.IGNORECASE)
"""Names of codes that stand for no value."""
_CHECKS: dict[int, Callable[[bytearray, Any], bool]] = {
    1: lambda data, identifier: e2e_p01_check(data, identifier),
    2: lambda data, identifiers: e2e_p02_check(bytes(data), bytes(identifiers), length=0),
    5: lambda data, identifier: e2e_p05_check(bytes(data), identifier),
}


def load_database(path: str | Path) -> Database:
    """Return a DBC, or what else cantools reads. Raise LeverError."""
    try:
        loaded = cantools.database.load_file(path, strict=False, encoding=_encoding(Path(path)))
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}") from None
    except Exception as error:  # each format has its own
        reason = " ".join(str(error).split())  # some are of several lines
        raise LeverError(f"{path}: no database of CAN messages that cantools reads: {reason}") from None
    if not isinstance(loaded, Database) or not loaded.messages:
        raise LeverError(f"{path}: it describes no CAN message")
    return loaded


def _encoding(path: Path) -> str | None:
    """Return the encoding of a DBC, which does not say it.

    It is UTF-8 where the file is that, else what cantools takes for its format.
    """
    return "utf-8" if path.suffix.lower() == ".dbc" and encoding_of(str(path)) == UTF_8 else None


def find(database: Database, name: str, where: str) -> tuple[Message, Field]:
    """Return message and signal by MESSAGE.SIGNAL, or SIGNAL where it is the only one. Raise LeverError."""
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


def of_fd(message: Message) -> bool:
    """Return whether its frames are CAN FD."""
    return bool(message.is_fd) or message.length > 8


def _near(name: str, names: Iterable[str]) -> str:
    near = nearest_names(name, names)
    return f"; near to it: {', '.join(near)}" if near else ""


_Content = TypeVar("_Content")


@dataclass
class Timed(Generic[_Content]):
    """Frames of one message on one bus (their data), or values of one signal of those that are right."""

    time_us: list[int] = field(default_factory=list)
    content: list[_Content] = field(default_factory=list)


class BusSignals:
    """The signals that are asked for, out of logs."""

    def __init__(
        self, database: Database, wanted: Iterable[tuple[Message, Field]], protected: dict[str, Protection]
    ) -> None:
        """Raise LeverError for a protection that does not fit the database."""
        self.counts: dict[str, MessageCounts] = {}
        """By message."""
        self.fd: set[str] = set()
        """Messages that came as CAN FD, whose data bulk.FRAME does not hold: add_fd() takes them."""
        self._messages: dict[tuple[int, bool], Message] = {}
        self._fields: dict[str, dict[str, Field]] = defaultdict(dict)  # by message
        for message, signal in wanted:
            self._messages[message.frame_id, message.is_extended_frame] = message
            self._fields[message.name][signal.name] = signal
        self._protected = protected
        self._frames: dict[tuple[str, str], Timed[bytes]] = defaultdict(Timed)  # by message and bus
        self._decoded: dict[tuple[str, str], dict[str, Timed[float]]] = {}
        for name, protection in protected.items():
            if protection.counter is not None:
                find(database, f"{name}.{protection.counter}", f"[protected.{name}]")
            elif name not in {each.name for each in database.messages}:
                raise LeverError(f"the mapping protects {name}, which is no message of the database")

    def add(self, frames: Frames, recording: Recording) -> None:
        """Keep what is needed of further frames."""
        names = recording.buses.names()
        for (identifier, extended), message in self._messages.items():
            same = (frames["id"] == identifier) & ((frames["flags"] & EXTENDED != 0) == extended)
            same &= frames["flags"] & (REMOTE | ERROR) == 0
            of_fd = frames["flags"] & FD != 0
            if (same & of_fd).any():
                self.fd.add(message.name)
            chosen = frames[same & ~of_fd]
            for bus in np.unique(chosen["bus"]):
                kept = chosen[chosen["bus"] == bus]
                received = self._frames[message.name, names[bus]]
                received.time_us += kept["time_us"].tolist()
                raw = np.ascontiguousarray(kept["data"]).tobytes()
                received.content += [raw[8 * k : 8 * k + length] for k, length in enumerate(kept["length"].tolist())]

    def add_fd(self, path: str, first_us: int, last_us: int) -> None:
        """Keep what is needed of the frames of CAN FD in a log, from one time to another. Raise LeverError."""
        import can

        try:
            with can.LogReader(path) as log:
                for frame in log:
                    message = self._messages.get((frame.arbitration_id, frame.is_extended_id))
                    time_us = round(1e6 * frame.timestamp)
                    if message is not None and frame.is_fd and first_us <= time_us < last_us:
                        bus = "can" if frame.channel is None else "_".join(str(frame.channel).split()) or "can"
                        received = self._frames[message.name, bus]
                        received.time_us.append(time_us)
                        received.content.append(bytes(frame.data))
        except Exception as error:  # each format has its own
            raise LeverError(f"{path}: its frames of CAN FD cannot be read: {error}") from None

    def signal(self, message: Message, name: str, channel: str | None, log: str) -> tuple[Signal, str]:
        """Return a signal of a message, and on which bus: if not given, the only one that has it. Raise LogError."""
        bus = self._bus(message, channel, log)
        if (message.name, bus) not in self._decoded:
            self._decoded[message.name, bus] = self._decode(message, self._frames[message.name, bus])
        decoded, each = self._decoded[message.name, bus][name], self._fields[message.name][name]
        time, values = np.array([1e-6 * at for at in decoded.time_us]), np.array(decoded.content, np.float64)
        return Signal(f"{message.name}.{name}", time, values, each.unit or "", each.comment or ""), bus

    def buses(self, message: Message) -> list[str]:
        """Return which buses have it."""
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
        raise LogError(f"{log}: no frame of {what} in it")

    def _decode(self, message: Message, received: Timed[bytes]) -> dict[str, Timed[float]]:
        """Return the signals of each frame that is right; a multiplexed one is not in all of them."""
        counts = self.counts.setdefault(message.name, MessageCounts())
        counts.frames += len(received.content)
        protection = self._protected.get(message.name)
        decoded: dict[str, Timed[float]] = {name: Timed() for name in self._fields[message.name]}
        counter = _Counter(message, protection, counts)
        for time_us, data in zip(received.time_us, received.content, strict=True):
            if not _is_right(protection, data):
                counts.corrupt += 1
                continue
            try:
                values: Any = message.decode(data, decode_choices=True, allow_truncated=True)
            except Exception:  # cantools raises what its decoder happens to
                counts.undecoded += 1
                continue
            if counter.is_new(values):
                for name, each in self._fields[message.name].items():
                    if name in values:
                        decoded[name].time_us.append(time_us)
                        decoded[name].content.append(number(each, values[name]))
        return decoded


def _is_right(protection: Protection | None, data: bytes) -> bool:
    """By the CRC of its profile, where one is known."""
    if protection is None or protection.profile is None:
        return True
    return len(data) >= 3 and _CHECKS[protection.profile](bytearray(data), protection.data_id)


class _Counter:
    """Follows the counter of a message, where the mapping names one."""

    def __init__(self, message: Message, protection: Protection | None, counts: MessageCounts) -> None:
        self._name = None if protection is None else protection.counter
        self._counts = counts
        self._last: int | None = None
        if self._name is not None and protection is not None:
            values = 1 << message.get_signal_by_name(self._name).length
            self._turn = values - 1 if protection.profile == 1 else values  # profile 1 leaves out the last

    def is_new(self, values: Any) -> bool:
        """Return False for a frame that is repeated; count it, or what was lost before it."""
        if self._name is None or self._name not in values:
            return True
        step = 1 if self._last is None else (int(values[self._name]) - self._last) % self._turn
        self._last = int(values[self._name])
        self._counts.lost += max(step - 1, 0)
        self._counts.repeated += step == 0
        return step != 0


def number(signal: Field, value: Any) -> float:
    """Return a decoded value; NaN for none, and for a code that stands for none."""
    if isinstance(value, NamedSignalValue):
        code = signal.conversion.raw_to_scaled(value.value, decode_choices=False)
        return float("nan") if _NO_VALUE.search(value.name) else float(code)  # type: ignore[arg-type]
    return float("nan") if value is None else float(value)
