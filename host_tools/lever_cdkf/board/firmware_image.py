"""An image for the STM32F405 as bytes of flash, from any form that the build writes; and whether it is whole."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from ..errors import LeverError

FLASH = 0x0800_0000
"""Where flash begins (RM0090 2.3)."""
FLASH_BYTES = 1024 * 1024
_PT_LOAD = 1
_HEX_DATA, _HEX_END, _HEX_UPPER = 0, 1, 4


def _pieces_of_elf(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield physical address and contents of each loaded segment of a 32-bit little-endian ELF file."""
    header_offset, entry_size, entries = *struct.unpack_from("<I", data, 28), *struct.unpack_from("<HH", data, 42)
    for index in range(entries):
        kind, offset, _, address, size = struct.unpack_from("<5I", data, header_offset + index * entry_size)
        if kind == _PT_LOAD and size:
            yield address, data[offset : offset + size]


def _pieces_of_hex(text: str) -> Iterator[tuple[int, bytes]]:
    """Yield address and contents of each data record of an Intel HEX file. Raise ValueError."""
    upper = 0
    for line in text.split():
        record = bytes.fromhex(line.removeprefix(":"))
        if len(record) != record[0] + 5 or sum(record) % 256:
            raise ValueError(line)
        address, kind, data = int.from_bytes(record[1:3], "big"), record[3], record[4:-1]
        if kind == _HEX_DATA:
            yield upper + address, data
        elif kind == _HEX_UPPER:
            upper = int.from_bytes(data, "big") << 16
        elif kind == _HEX_END:
            return


def flash_contents(path: Path) -> bytes:
    """Return what `path` (.elf, .hex, .bin) puts into flash.

    Raise LeverError, also when it is not a whole image of ours.

    The build ends an image with the CRC-32 of all before it (firmware/port/stm32f4/rom_crc.py), which is checked here.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LeverError(f"cannot read {path}: {error.strerror}") from None
    try:
        if path.suffix == ".bin":
            pieces = [(FLASH, data)]
        elif path.suffix == ".hex":
            pieces = list(_pieces_of_hex(data.decode("ascii")))
        elif data.startswith(b"\x7fELF\x01\x01"):
            pieces = list(_pieces_of_elf(data))
        else:
            raise LeverError(f"{path} is neither .bin nor .hex nor a 32-bit ELF file")
        contents = bytearray()
        for address, piece in sorted(pieces):
            if address != FLASH + len(contents):
                raise ValueError(f"a gap at {FLASH + len(contents):#x}")
            contents += piece
    except (ValueError, IndexError, struct.error):
        contents = bytearray()
    if not 8 <= len(contents) <= FLASH_BYTES or zlib.crc32(contents[:-4]) != int.from_bytes(contents[-4:], "little"):
        raise LeverError(
            f"{path} is damaged or no image of this project: it does not end with its CRC. "
            "Build it anew: cmake --preset stm32f4 && cmake --build --preset stm32f4"
        )
    return bytes(contents)
