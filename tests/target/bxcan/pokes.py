"""CAN1 without a processor: tests play the software, register by register."""

from __future__ import annotations

from target.bxcan.bus import BIT_NS, Bus, Peer
from target.bxcan.bxcan import ABOM, BTR, INAK, INRQ, MAILBOXES, MCR, MSR, BxCan
from target.bxcan.filters import FA1R, FM1R, FMR, FMR_RESET, FS1R
from target.bxcan.frame import Frame
from target.bxcan.schedule import Schedule

BTR_1_MBIT = 2 | 10 << 16 | 1 << 20
"""42 MHz / 3 = 14 MHz: 1 + 11 + 2 quanta, sampled at 12/14."""


class Desk:
    """A CAN1 with its clock and pins in order, a bus, and another node on it."""

    def __init__(self) -> None:
        self.schedule = Schedule()
        self.bus = Bus(self.schedule)
        self.misuses: list[str] = []
        self.pins: str | None = None
        self.is_clocked = True
        self.can = BxCan(self.bus, self)
        self.peer = Peer(self.bus)

    def apb1_hz(self) -> float:
        return 42e6

    def is_can_clocked(self) -> bool:
        return self.is_clocked

    def can_pin_problem(self) -> str | None:
        return self.pins

    def misuse(self, what: str) -> None:
        self.misuses.append(what)

    def read(self, offset: int) -> int:
        return self.can.read(offset, 4)

    def write(self, offset: int, value: int) -> None:
        self.can.write(offset, 4, value)

    def wait(self, bits: float) -> None:
        self.schedule.advance(self.schedule.now + round(bits * BIT_NS))

    def initialise(self) -> None:
        self.write(MCR, INRQ)
        self.wait(2)
        assert self.read(MSR) & INAK

    def start(self, mcr: int = ABOM, btr: int = BTR_1_MBIT) -> None:
        """To normal mode, with every frame into FIFO 0."""
        self.initialise()
        self.write(BTR, btr)
        self.write(FMR, FMR_RESET)
        self.write(FS1R, 1)
        self.write(FM1R, 0)
        self.write(FA1R, 1)
        self.write(FMR, FMR_RESET & ~1)
        self.write(MCR, mcr)
        self.wait(12)
        assert not self.read(MSR) & INAK

    def load(self, mailbox: int, frame: Frame) -> None:
        """Request a transmission."""
        at = MAILBOXES + 16 * mailbox
        data = frame.data.ljust(8, b"\0")
        self.write(at + 4, frame.length)
        self.write(at + 8, int.from_bytes(data[:4], "little"))
        self.write(at + 12, int.from_bytes(data[4:], "little"))
        identifier = frame.identifier << 3 | 4 if frame.extended else frame.identifier << 21
        self.write(at, identifier | frame.remote << 1 | 1)
