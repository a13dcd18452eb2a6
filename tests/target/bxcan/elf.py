"""What an ELF file says about an image: what is loaded where, its symbols, and which function an address is in."""

from __future__ import annotations

import bisect
from pathlib import Path

from elftools.elf.elffile import ELFFile

VECTORS_IN_FLASH = 0x08000000


class Image:
    """`segments` are (address in flash, bytes), `symbols` addresses by name."""

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            elf = ELFFile(file)
            loaded = [segment for segment in elf.iter_segments() if segment["p_type"] == "PT_LOAD"]
            self.segments = [(segment["p_paddr"], segment.data()) for segment in loaded if segment["p_filesz"]]
            table = elf.get_section_by_name(".symtab")
            symbols = list(table.iter_symbols())
        self.symbols = {symbol.name: symbol["st_value"] for symbol in symbols if symbol.name}
        self.sizes = {symbol.name: symbol["st_size"] for symbol in symbols if symbol.name}
        functions = [symbol for symbol in symbols if symbol["st_info"]["type"] == "STT_FUNC"]
        self._functions = sorted((symbol["st_value"] & ~1, symbol.name) for symbol in functions)
        self.vectors = VECTORS_IN_FLASH

    def is_code(self, address: int) -> bool:
        return any(start <= address < start + len(data) for start, data in self.segments)

    def find(self, instruction: bytes) -> list[int]:
        """Where a 16-bit instruction is, or what looks like it."""
        places = []
        for start, data in self.segments:
            places += [start + k for k in range(0, len(data) - 1, 2) if data[k : k + 2] == instruction]
        return places

    def describe(self, address: int) -> str:
        """The function that an address is in, for a person."""
        index = bisect.bisect_right(self._functions, (address, "\uffff")) - 1
        if index < 0:
            return f"at {address:#x}"
        start, name = self._functions[index]
        return f"in {name}+{address - start:#x}"
