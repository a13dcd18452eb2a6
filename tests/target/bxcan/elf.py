"""What this model asks of an image: its bytes in flash, its symbols, and which function an address is in."""

from __future__ import annotations

import bisect
from pathlib import Path

from target.stm32f4 import elf

FLASH = elf.FLASH


class Image:
    """`flash` begins at FLASH, with the vector table; `symbols` are addresses by name."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.flash = bytes(elf.flash_bytes(path))
        rows = [line.split() for line in elf.tool("nm", path).splitlines()]
        self.symbols = {row[2]: int(row[0], 16) for row in rows if len(row) == 3}
        self._functions = sorted((int(row[0], 16), row[2]) for row in rows if len(row) == 3 and row[1] in "tT")

    def find(self, instruction: bytes) -> list[int]:
        """Where a 16-bit instruction is, or what looks like it."""
        return [FLASH + k for k in range(0, len(self.flash) - 1, 2) if self.flash[k : k + 2] == instruction]

    def describe(self, address: int) -> str:
        """Return the function that an address is in, for a person."""
        index = bisect.bisect_right(self._functions, (address, "\uffff")) - 1
        if index < 0:
            return f"at {address:#x}"
        start, name = self._functions[index]
        return f"in {name}+{address - start:#x}"
