"""Records a bus into a log of candump's format, and counts what is missing in it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import can

from ..errors import LeverError
from . import codec
from .buses import make_room
from .identifiers import from_bus
from .message_counts import MessageCounter

PARTIAL = ".partial"
"""Ending of a log that is being recorded, or whose recording broke off."""
_LISTEN = 0.1
"""[s] between two looks at whether to end."""
_CONTROLLER, _BUS_OFF, _RESTARTED = 0x04, 0x40, 0x100  # classes of error frames, and conditions: <linux/can/error.h>
_RX_OVERFLOW, _WARNING, _PASSIVE, _ACTIVE = 0x01, 0x0C, 0x30, 0x40
_TELL = 1.0
"""[s] between two tellings, each of which also hands to the system what has been recorded."""


class Recorder:
    """The frames of a bus into `path`, which is there, complete, after run() only.

    Until then, and when something goes wrong, it is called `path`.partial.
    """

    def __init__(self, bus: can.BusABC, path: Path, channel: str) -> None:
        self.frames = 0
        self.error_frames = 0
        self.others = 0
        """Frames that are in no message of lever.dbc."""
        self.messages = {each.frame_id: MessageCounter(each.name) for each in codec.database().messages}
        self.bus_state = "active"
        """Of the controller, as error frames or the interface tell: active, warning, passive, bus off, error."""
        self.left_active = 0
        """Times that it stopped being active."""
        self.overflows = 0
        """Times that the controller had no room for a frame."""
        self.partial = path.with_name(path.name + PARTIAL)
        self._bus, self._path, self._channel = bus, path, channel
        self._is_socketcan = type(bus).__name__ == "SocketcanBus"
        make_room(bus)
        self._start = time.monotonic()

    @property
    def lost(self) -> int:
        """Frames of lever.dbc that never came."""
        return sum(each.lost for each in self.messages.values())

    @property
    def corrupt(self) -> int:
        """Frames of lever.dbc with a wrong CRC or length."""
        return sum(each.corrupt for each in self.messages.values())

    @property
    def elapsed(self) -> float:
        """[s] since the start."""
        return time.monotonic() - self._start

    def run(self, ended: Callable[[], bool], tell: Callable[[Recorder], None]) -> None:
        """Record until `ended` is true, asked ten times a second; `tell` is called each second. Raise LeverError."""
        for path in (self._path, self.partial):
            if path.exists():
                raise LeverError(f"{path} exists already: choose another name, or move it away")
        self._start = time.monotonic()
        try:
            with self.partial.open("w", encoding="ascii", errors="replace") as file:
                self._record(can.CanutilsLogWriter(file, channel=self._channel), file, ended, tell)
                os.fsync(file.fileno())
            self.partial.rename(self._path)
        except OSError as error:
            raise LeverError(f"cannot write {self._path}: {error.strerror or error}; {self._kept()}") from None
        except can.CanError as error:
            raise LeverError(f"the bus failed: {error}; {self._kept()}") from None

    def _kept(self) -> str:
        if not self.partial.exists():
            return "nothing is recorded"
        return f"what was recorded until then, up to {self.frames} frames, is in {self.partial}"

    def _record(
        self, writer: can.Listener, file: Any, ended: Callable[[], bool], tell: Callable[[Recorder], None]
    ) -> None:
        last_report = time.monotonic()
        while not ended():
            until = time.monotonic() + _LISTEN
            while (now := time.monotonic()) < until:
                message = self._bus.recv(until - now)
                if message is not None:
                    writer.on_message_received(message)
                    self._count(message)
            if now - last_report >= _TELL:
                last_report = now
                file.flush()
                self._look(now)
                tell(self)
        self._look(time.monotonic())

    def _count(self, message: can.Message) -> None:
        self.frames += 1
        identifier, extended = from_bus(message.arbitration_id, message.is_extended_id)
        counts = self.messages.get(identifier)
        if message.is_error_frame:
            self.error_frames += 1
            if self._is_socketcan:
                self._take_error(message)
        elif counts is None or extended or message.is_remote_frame:
            self.others += 1
        else:
            counts.take((message.data,), self.elapsed)

    def _look(self, now: float) -> None:
        """At the rates, and at the state of the controller, as far as the interface knows it."""
        for each in self.messages.values():
            each.tick(now - self._start)
        if not self._is_socketcan:  # which has no state but in its error frames
            with suppress(NotImplementedError, can.CanError):
                self._enter(self._bus.state.name.lower())

    def _take_error(self, message: can.Message) -> None:
        """Count an error frame of SocketCAN: its identifier is a mask of classes, byte 1 the controller's state."""
        conditions = message.data[1] if message.arbitration_id & _CONTROLLER and len(message.data) > 1 else 0
        self.overflows += bool(conditions & _RX_OVERFLOW)
        if message.arbitration_id & _BUS_OFF:
            self._enter("bus off")
        elif message.arbitration_id & _RESTARTED or conditions & _ACTIVE:
            self._enter("active")
        elif conditions & _PASSIVE:
            self._enter("passive")
        elif conditions & _WARNING:
            self._enter("warning")

    def _enter(self, state: str) -> None:
        if state != "active" and self.bus_state == "active":
            self.left_active += 1
        self.bus_state = state
