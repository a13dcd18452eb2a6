"""The three transmit mailboxes of bxCAN: RM0090 32.7.1, 32.9.2 (CAN_TSR) and 32.9.3."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

from target.bxcan.frame import Frame

TXRQ = 1
RQCP, TXOK, ALST, TERR, ABRQ = 1, 2, 4, 8, 0x80
"""Bits of CAN_TSR for mailbox 0; those of the others are 8 and 16 further up."""
TSR_WRITABLE = 0x8F8F8F


@dataclass
class Mailbox:
    identifier: int = 0
    length: int = 0
    low: int = 0
    high: int = 0
    status: int = 0
    order: int = -1
    """When its transmission was requested, in requests; -1: the mailbox is empty."""

    @property
    def is_pending(self) -> bool:
        return self.order >= 0

    @property
    def frame(self) -> Frame:
        extended, remote = bool(self.identifier >> 2 & 1), bool(self.identifier >> 1 & 1)
        identifier = self.identifier >> 3 if extended else self.identifier >> 21
        length = self.length & 15
        data = (self.low | self.high << 32).to_bytes(8, "little")[: min(8, length)]
        return Frame(identifier, b"" if remote else data, extended, remote, length if remote else -1)


class Mailboxes:
    def __init__(self, misuse: Callable[[str], None]) -> None:
        self.misuse = misuse
        self.boxes = [Mailbox() for _ in range(3)]
        self.by_request = False
        """TXFP: in the order of requests, instead of by identifier."""
        self.sending: Mailbox | None = None
        self._requests = itertools.count()

    def _ranked(self) -> list[Mailbox]:
        """Return those pending, the first to be sent first; of equal identifiers the lower mailbox."""
        pending = [box for box in self.boxes if box.is_pending]
        if self.by_request:
            return sorted(pending, key=lambda box: box.order)
        return sorted(pending, key=lambda box: (box.frame.arbitration, self.boxes.index(box)))

    def next(self) -> Mailbox | None:
        ranked = self._ranked()
        return ranked[0] if ranked else None

    def read(self, offset: int) -> int:
        """Return offset counts from CAN_TI0R."""
        box = self.boxes[offset // 16]
        return (box.identifier | box.is_pending, box.length, box.low, box.high)[offset // 4 % 4]

    def write(self, offset: int, value: int) -> bool:
        """Return whether a transmission has been requested."""
        number, register = offset // 16, offset // 4 % 4
        box = self.boxes[number]
        if box.is_pending:
            self.misuse(f"writes transmit mailbox {number} while it is occupied")
            return False
        if register == 1:
            if value & 0xFFFF & ~0x010F:
                self.misuse(f"sets reserved bits of TDT{number}R: {value:#010x}")
            if value & 15 > 8:
                self.misuse(f"asks for {value & 15} data bytes in TDT{number}R")
            box.length = value
        elif register >= 2:
            setattr(box, ("low", "high")[register - 2], value)
        else:
            if not value & 4 and value & 0x1FFFF8:
                self.misuse(f"sets extended identifier bits of a standard frame in TI{number}R: {value:#010x}")
            box.identifier = value & ~TXRQ
            if value & TXRQ:
                box.order = next(self._requests)
                box.status = 0
                return True
        return False

    def status(self) -> int:
        """CAN_TSR: status bits, TME, CODE, LOW."""
        value = 0
        for k, box in enumerate(self.boxes):
            value |= box.status << (8 * k) | (not box.is_pending) << (26 + k)
        ranked = self._ranked()
        free = [k for k, box in enumerate(self.boxes) if not box.is_pending]
        if len(ranked) > 1:
            value |= 1 << (29 + self.boxes.index(ranked[-1]))
        return value | (free[0] if free else self.boxes.index(ranked[-1])) << 24

    def write_status(self, value: int) -> None:
        if value & ~TSR_WRITABLE & 0xFFFFFF:
            self.misuse(f"sets reserved bits of TSR: {value:#010x}")
        for k, box in enumerate(self.boxes):
            written = value >> (8 * k) & 0xFF
            if written & RQCP:
                box.status = 0
            box.status &= ~(written & (TXOK | ALST | TERR))
            if written & ABRQ:
                self._abort(box)

    def _abort(self, box: Mailbox) -> None:
        """Abort a mailbox; an empty one stays as it is (32.9.2)."""
        if box is self.sending:
            box.status |= ABRQ
        elif box.is_pending:
            self.complete(box, 0)

    def complete(self, box: Mailbox, result: int) -> None:
        box.order = -1
        box.status = RQCP | result
