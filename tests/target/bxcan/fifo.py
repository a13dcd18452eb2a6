"""A receive FIFO of bxCAN, three messages deep: RM0090 32.7.3, 32.9.2 (CAN_RFxR) and 32.9.3."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from target.bxcan.frame import Frame
from target.bxcan.schedule import Timers

DEPTH = 3
FULL, FOVR, RFOM = 1 << 3, 1 << 4, 1 << 5
RELEASE_NS = 100
"""How long a message is being released, some cycles of APB1: RFOM reads as 1 and FMP as before."""


@dataclass
class Message:
    frame: Frame
    filter_index: int

    def read(self, register: int) -> int:
        """RIxR, RDTxR, RDLxR, RDHxR. Of unused data bytes the value is not defined: here 0xA5."""
        frame = self.frame
        if register == 0:
            identifier = frame.identifier << 3 | 4 if frame.extended else frame.identifier << 21
            return identifier | frame.remote << 1
        if register == 1:
            return self.filter_index << 8 | frame.length
        data = frame.data.ljust(8, b"\xa5")
        return int.from_bytes(data[:4] if register == 2 else data[4:], "little")


@dataclass
class Fifo:
    number: int
    misuse: Callable[[str], None]
    timers: Timers
    messages: list[Message] = field(default_factory=list)
    flags: int = 0
    lost: int = 0
    """Messages that found no room, or lost it."""
    taken: int = 0

    @property
    def is_full(self) -> bool:
        return bool(self.flags & FULL)

    @property
    def is_overrun(self) -> bool:
        return bool(self.flags & FOVR)

    def put(self, message: Message, is_locked: bool) -> None:
        """`is_locked` (RFLM): when full, the new message is lost, and not the last of the old ones."""
        if len(self.messages) == DEPTH:
            self.flags |= FOVR
            self.lost += 1
            if is_locked:
                return
            self.messages.pop()
        self.messages.append(message)
        if len(self.messages) == DEPTH:
            self.flags |= FULL

    def status(self) -> int:
        return self.flags | len(self.messages)

    def write_status(self, value: int) -> None:
        if value & ~(FULL | FOVR | RFOM | 3):
            self.misuse(f"sets reserved bits of RF{self.number}R: {value:#010x}")
        self.flags &= ~(value & (FULL | FOVR))
        if value & RFOM:
            if not self.messages:
                self.misuse(f"releases FIFO {self.number}, which is empty")
            elif self.flags & RFOM:
                self.misuse(f"releases FIFO {self.number} again while RFOM is 1")
            else:
                self.flags |= RFOM
                self.timers.after(RELEASE_NS, self._released)

    def _released(self) -> None:
        self.flags &= ~RFOM
        self.messages.pop(0)
        self.taken += 1

    def read(self, register: int) -> int:
        if not self.messages or self.flags & RFOM:
            self.misuse(f"reads a message from FIFO {self.number}, which is empty or being released")
            return 0
        return self.messages[0].read(register)
