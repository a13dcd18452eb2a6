"""CAN1 of an STM32F405 on a bus: the registers of bxCAN, written from RM0090 (rev. 19) chapter 32, not from the driver.

What the manual forbids, or leaves undefined, is told to `Surroundings.misuse` with the reason, and has no effect.
"""

from __future__ import annotations

from typing import Protocol

from target.bxcan import filters, mailboxes
from target.bxcan.bus import BIT_NS, Bus, Error
from target.bxcan.confinement import Confinement
from target.bxcan.fifo import Fifo, Message
from target.bxcan.filters import Filters
from target.bxcan.frame import Frame
from target.bxcan.mailboxes import Mailboxes
from target.bxcan.schedule import Action, Timers

MCR, MSR, TSR, RF0R, RF1R, IER, ESR, BTR = range(0, 0x20, 4)
MAILBOXES, FIFO_0, FIFO_1, FIFO_END = 0x180, 0x1B0, 0x1C0, 0x1D0

INRQ, SLEEP, TXFP, RFLM, NART, AWUM, ABOM, TTCM, RESET, DBF = (1 << k for k in (0, 1, 2, 3, 4, 5, 6, 7, 15, 16))
MCR_RESET, BTR_RESET = 0x00010002, 0x01230000
MCR_BITS, MSR_BITS, IER_BITS, BTR_BITS = 0x000180FF, 0xF1F, 0x00038F7F, 0xC37F03FF
INAK, SLAK, ERRI, WKUI, SLAKI = 1, 2, 4, 8, 16
LBKM, SILM = 1 << 30, 1 << 31
TMEIE, LECIE, ERRIE = 1, 1 << 11, 1 << 15
BOFF = 4
RECOVERY_RUNS = 128
TX_IRQ, RX0_IRQ, RX1_IRQ, SCE_IRQ = 19, 20, 21, 22


class Surroundings(Protocol):
    """What CAN1 has to do with on the chip."""

    def apb1_hz(self) -> float: ...
    def is_can_clocked(self) -> bool: ...
    def can_pin_problem(self) -> str | None:
        """Return what is wrong with the pins of CAN1_RX and CAN1_TX."""

    def misuse(self, what: str) -> None: ...


class BxCan:
    def __init__(self, bus: Bus, surroundings: Surroundings) -> None:
        self.bus, self.surroundings = bus, surroundings
        self.timers = Timers(bus.schedule)
        self.confinement = Confinement()
        self.bus_offs = 0
        bus.nodes.append(self)
        self.reset()

    def reset(self) -> None:
        self.timers.cancel()
        misuse = self._misuse
        self.mcr, self.ier, self.btr, self.lec = MCR_RESET, 0, BTR_RESET, 0
        self.mode = SLAK
        """SLAK in sleep mode, INAK in initialisation mode, 0 in normal mode."""
        self.flags = 0
        self.tx = Mailboxes(misuse)
        self.filters = Filters(misuse)
        self.fifos = (Fifo(0, misuse, self.timers), Fifo(1, misuse, self.timers))
        self._is_changing = False
        self._is_fit = False
        self.confinement.clear()

    def _misuse(self, what: str) -> None:
        self.surroundings.misuse(f"CAN1: {what}")

    # --- registers ---------------------------------------------------------------------------------------------

    def read(self, offset: int, size: int) -> int:
        if not self._is_accessible(offset, size):
            return 0
        if MAILBOXES <= offset < FIFO_0:
            return self.tx.read(offset - MAILBOXES)
        if FIFO_0 <= offset < FIFO_END:
            return self.fifos[offset >= FIFO_1].read(offset // 4 % 4)
        if filters.FMR <= offset < filters.END:
            return self.filters.read(offset)
        return self._control(offset)

    def _control(self, offset: int) -> int:
        if offset == MSR:
            mine = self.bus.sender is self
            activity = mine << 8 | (self.bus.sender is not None and not mine) << 9
            return 1 << 11 | 1 << 10 | activity | self.flags | self.mode
        registers = {MCR: self.mcr, TSR: self.tx.status(), RF0R: self.fifos[0].status(), RF1R: self.fifos[1].status()}
        registers |= {IER: self.ier, ESR: self.confinement.register() | self.lec << 4, BTR: self.btr}
        if offset not in registers:
            self._misuse(f"reads the reserved register {offset:#x}")
        return registers.get(offset, 0)

    def write(self, offset: int, size: int, value: int) -> None:
        if not self._is_accessible(offset, size):
            return
        if MAILBOXES <= offset < FIFO_0:
            if self.tx.write(offset - MAILBOXES, value):
                self.bus.request()
        elif filters.FMR <= offset < filters.END:
            self.filters.write(offset, value)
        else:
            controls = {MCR: self._write_mcr, MSR: self._write_msr, TSR: self.tx.write_status, IER: self._write_ier}
            controls |= {RF0R: self.fifos[0].write_status, RF1R: self.fifos[1].write_status}
            controls |= {ESR: self._write_esr, BTR: self._write_btr}
            if offset in controls:
                controls[offset](value)
            else:
                self._misuse(f"writes the read-only or reserved register {offset:#x}")

    def _write_ier(self, value: int) -> None:
        self._expect_only(IER_BITS, value, "IER")
        self.ier = value & IER_BITS

    def _write_msr(self, value: int) -> None:
        self._expect_only(MSR_BITS, value, "MSR")
        self.flags &= ~(value & (ERRI | WKUI | SLAKI))

    def _write_esr(self, value: int) -> None:
        self.lec = value >> 4 & 7

    def _is_accessible(self, offset: int, size: int) -> bool:
        if not self.surroundings.is_can_clocked():
            self._misuse(f"register {offset:#x} is accessed while CAN1EN in RCC_APB1ENR is 0")
        elif size != 4 or offset % 4:
            self._misuse(f"register {offset:#x} is accessed by {size} bytes; it must be a word (32.9)")
        else:
            return True
        return False

    def _expect_only(self, bits: int, value: int, name: str) -> None:
        if value & ~bits:
            self._misuse(f"sets reserved bits of {name}: {value:#010x}")

    # --- modes (32.4) ------------------------------------------------------------------------------------------

    def _write_mcr(self, value: int) -> None:
        self._expect_only(MCR_BITS, value, "MCR")
        if value & RESET:
            self.reset()
            return
        self.mcr = value & MCR_BITS
        self.tx.by_request = bool(value & TXFP)
        self._pursue()

    def _pursue(self) -> None:
        """Start towards the mode that MCR asks for."""
        wanted = self._wanted()
        if wanted == self.mode or self._is_changing:
            return
        self._is_changing = True
        if wanted:
            self.timers.after(BIT_NS, self._leave_bus)
        else:
            self._is_fit = self._check_fitness()
            self.bus.when_recessive(1, self.timers.guard(lambda: self._arrive(0)))

    def _wanted(self) -> int:
        return INAK if self.mcr & INRQ else SLAK if self.mcr & SLEEP else 0

    def _leave_bus(self) -> None:
        if self.mode == 0 and self.bus.sender is not None:  # the frame on the bus ends first
            self.timers.after(BIT_NS, self._leave_bus)
        else:
            self._arrive(self._wanted())

    def _arrive(self, mode: int) -> None:
        self.mode = mode
        self._is_changing = False
        if mode == 0:
            if self.confinement.is_off:
                self._recover()
            self.bus.request()
        self._pursue()

    def _write_btr(self, value: int) -> None:
        self._expect_only(BTR_BITS, value, "BTR")
        if self.mode == INAK:
            self.btr = value & BTR_BITS
        else:
            self._misuse("BTR is written outside initialisation mode (32.9.2)")

    def bit_time_ns(self) -> float:
        """32.7.7: a quantum of synchronisation, then TS1 + 1 and TS2 + 1 of them."""
        quanta = 3 + (self.btr >> 16 & 15) + (self.btr >> 20 & 7)
        return quanta * ((self.btr & 0x3FF) + 1) * 1e9 / self.surroundings.apb1_hz()

    def sample_point(self) -> float:
        """Where in the bit it is sampled, from 0 to 1."""
        before = 2 + (self.btr >> 16 & 15)
        return before / (before + 1 + (self.btr >> 20 & 7))

    def _check_fitness(self) -> bool:
        """Return whether the bus and this node will understand each other."""
        problems = []
        if self.btr == BTR_RESET:
            problems.append("BTR has not been set")
        if self.btr & (LBKM | SILM):
            problems.append("loop-back or silent mode")
        if abs(self.bit_time_ns() - BIT_NS) > 0.005 * BIT_NS:
            problems.append(f"a bit lasts {self.bit_time_ns():.1f} ns; on this bus {BIT_NS}")
        if (pins := self.surroundings.can_pin_problem()) is not None:
            problems.append(pins)
        if self.filters.is_initialising:
            problems.append("FINIT is set, so nothing can be received")
        for problem in problems:
            self._misuse(f"initialisation mode is left, but {problem}")
        return not problems

    # --- on the bus --------------------------------------------------------------------------------------------

    def _is_active(self) -> bool:
        return self.mode == 0 and self._is_fit and not self.confinement.is_off

    def offer(self) -> Frame | None:
        box = self.tx.next() if self._is_active() else None
        return None if box is None else box.frame

    def acknowledges(self) -> bool:
        return self._is_active()

    def is_passive(self) -> bool:
        return self.confinement.is_passive

    def starts(self) -> None:
        self.tx.sending = self.tx.next()

    def lost_arbitration(self) -> None:
        box = self.tx.next()
        if box is not None and self.mcr & NART:
            self.tx.complete(box, mailboxes.ALST)

    def sent(self, frame: Frame) -> None:
        self._finish(mailboxes.TXOK)
        self.confinement.sent()
        self.lec = Error.NONE

    def send_failed(self, error: Error) -> None:
        self._finish(mailboxes.TERR)
        self._count(error, lambda: self.confinement.send_failed(error))

    def _finish(self, result: int) -> None:
        box, self.tx.sending = self.tx.sending, None
        if box is not None and (result == mailboxes.TXOK or self.mcr & NART or box.status & mailboxes.ABRQ):
            self.tx.complete(box, result)

    def received(self, frame: Frame) -> None:
        if self._is_active():
            self.confinement.received()
            self.lec = Error.NONE
            match = self.filters.match(frame)
            if match is not None:
                self.fifos[match[0]].put(Message(frame, match[1]), is_locked=bool(self.mcr & RFLM))

    def receive_failed(self, error: Error) -> None:
        if self._is_active():
            self._count(error, self.confinement.receive_failed)

    def _count(self, error: Error, count: Action) -> None:
        """Count an error, and report what the counters have reached."""
        before = self.confinement.register()
        count()
        self.lec = error
        risen = self.confinement.register() & ~before & 7
        if risen & self.ier >> 8 or self.ier & LECIE:
            self.flags |= ERRI
        if risen & BOFF:
            self.bus_offs += 1
            if self.mcr & ABOM:
                self._recover()

    def _recover(self) -> None:
        """32.7.6: after 128 sequences of 11 recessive bits."""

        def recovered() -> None:
            self.confinement.clear()
            self.bus.request()

        self.bus.when_recessive(RECOVERY_RUNS, self.timers.guard(recovered))

    # --- interrupts (32.8) -------------------------------------------------------------------------------------

    def interrupts(self) -> set[int]:
        """Return numbers (table 62) of the interrupts asked for now."""
        asked = set()
        if self.ier & TMEIE and any(box.status & mailboxes.RQCP for box in self.tx.boxes):
            asked.add(TX_IRQ)
        for fifo, number, shift in zip(self.fifos, (RX0_IRQ, RX1_IRQ), (1, 4), strict=True):
            causes = bool(fifo.messages) | fifo.is_full << 1 | fifo.is_overrun << 2
            if causes & self.ier >> shift:
                asked.add(number)
        if self.ier & ERRIE and self.flags & ERRI:
            asked.add(SCE_IRQ)
        return asked
