"""Acceptance filters of bxCAN: RM0090 32.7.4 and 32.9.4. All 28 banks, of which CAN1 has those below CAN2SB."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from target.bxcan.frame import Frame

FMR, FM1R, FS1R, FFA1R, FA1R, BANKS, END = 0x200, 0x204, 0x20C, 0x214, 0x21C, 0x240, 0x320
FMR_RESET = 0x2A1C0E01
FMR_WRITABLE = 0x3F01
BANK_COUNT = 28
ALL_BANKS = (1 << BANK_COUNT) - 1
NAMES = {FM1R: "FM1R", FS1R: "FS1R", FFA1R: "FFA1R", FA1R: "FA1R"}


def image_32(frame: Frame) -> int:
    """Return identifier, IDE and RTR of a frame as a 32-bit filter sees them."""
    identifier = frame.identifier << 3 if frame.extended else frame.identifier << 21
    return identifier | frame.extended << 2 | frame.remote << 1


def image_16(frame: Frame) -> int:
    """Return the same for a 16-bit filter: STID, RTR, IDE, EXID[17:15]."""
    if frame.extended:
        base, top = frame.identifier >> 18, frame.identifier >> 15 & 7
        return base << 5 | frame.remote << 4 | 1 << 3 | top
    return frame.identifier << 5 | frame.remote << 4


@dataclass
class Filters:
    misuse: Callable[[str], None]
    registers: dict[int, int] = field(default_factory=lambda: {FMR: FMR_RESET, FM1R: 0, FS1R: 0, FFA1R: 0, FA1R: 0})
    banks: list[list[int]] = field(default_factory=lambda: [[0, 0] for _ in range(BANK_COUNT)])

    @property
    def is_initialising(self) -> bool:
        return bool(self.registers[FMR] & 1)

    def _bit(self, register: int, bank: int) -> bool:
        return bool(self.registers[register] >> bank & 1)

    def read(self, offset: int) -> int:
        if offset >= BANKS:
            return self.banks[(offset - BANKS) // 8][offset // 4 % 2]
        if offset not in self.registers:
            self.misuse(f"reads the reserved filter register {offset:#x}")
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int) -> None:
        if offset == FMR:
            if (value ^ FMR_RESET) & ~FMR_WRITABLE:
                self.misuse(f"changes reserved bits of FMR: {value:#010x}")
            self.registers[FMR] = value & FMR_WRITABLE | FMR_RESET & ~FMR_WRITABLE
        elif offset in NAMES:
            self._write_per_bank(offset, value)
        elif offset >= BANKS:
            bank = (offset - BANKS) // 8
            if not self.is_initialising and self._bit(FA1R, bank):
                self.misuse(f"writes filter bank {bank} while it is active and FINIT is 0")
                return
            self.banks[bank][offset // 4 % 2] = value
        else:
            self.misuse(f"writes the reserved filter register {offset:#x}")

    def _write_per_bank(self, offset: int, value: int) -> None:
        if value & ~ALL_BANKS:
            self.misuse(f"sets reserved bits of {NAMES[offset]}: {value:#010x}")
        if offset != FA1R and not self.is_initialising:
            self.misuse(f"writes {NAMES[offset]} while FINIT is 0")
            return
        self.registers[offset] = value & ALL_BANKS

    def _matches(self, bank: int, frame: Frame) -> list[bool]:
        """Return the matches of each filter in a bank, in the order of their numbers."""
        one, two = self.banks[bank]
        is_list = self._bit(FM1R, bank)
        if self._bit(FS1R, bank):
            image = image_32(frame)
            return [(image ^ one) & ~1 == 0, (image ^ two) & ~1 == 0] if is_list else [(image ^ one) & two == 0]
        low_one, high_one, low_two, high_two = one & 0xFFFF, one >> 16, two & 0xFFFF, two >> 16
        image = image_16(frame)
        if is_list:
            return [image == each for each in (low_one, high_one, low_two, high_two)]
        return [(image ^ low_one) & high_one == 0, (image ^ low_two) & high_two == 0]

    def match(self, frame: Frame) -> tuple[int, int] | None:
        """FIFO and filter match index of a frame; None where no filter takes it, and while FINIT is set."""
        if self.is_initialising:
            return None
        numbers = [0, 0]
        found: list[tuple[bool, bool, int, int, int]] = []
        for bank in range(self.registers[FMR] >> 8 & 0x3F):
            fifo = int(self._bit(FFA1R, bank))
            rank = (not self._bit(FS1R, bank), not self._bit(FM1R, bank))  # 32 bits before 16, list before mask
            for matches in self._matches(bank, frame):
                if matches and self._bit(FA1R, bank):
                    found.append((*rank, bank, fifo, numbers[fifo]))
                numbers[fifo] += 1
        return min(found)[3:] if found else None
