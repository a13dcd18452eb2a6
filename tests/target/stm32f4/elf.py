"""What these tests look up in an image: symbols, and the bytes that go into flash."""

from __future__ import annotations

import re
import subprocess
import zlib
from pathlib import Path

FLASH = 0x0800_0000


def tool(name: str, *arguments: str | Path) -> str:
    command = [f"arm-none-eabi-{name}", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def symbol(elf: Path, name: str) -> int:
    """Return the address of a symbol."""
    match = re.search(rf"^([0-9a-f]+) \w {name}$", tool("nm", elf), re.MULTILINE)
    assert match, f"{elf} has no {name}"
    return int(match[1], 16)


def flash_bytes(elf: Path) -> bytearray:
    """Return the contents of flash: the .bin beside the .elf."""
    return bytearray(elf.with_suffix(".bin").read_bytes())


def put_crc(flash: bytearray) -> None:
    """Make the CRC good again, as only a build does."""
    flash[-4:] = zlib.crc32(flash[:-4]).to_bytes(4, "little")


def instructions(elf: Path, function: str) -> list[tuple[int, bytes, str]]:
    """Return address, encoding and text of each instruction of a function, or of what the compiler has made of it, as
    function.isra.0."""
    (symbol,) = re.findall(rf" t ({re.escape(function)}(?:\.\w+)*)$", tool("nm", elf), re.MULTILINE | re.IGNORECASE)
    listing = tool("objdump", "-d", f"--disassemble={symbol}", elf)
    rows = re.findall(r"^ *([0-9a-f]+):\t([0-9a-f]{4}(?: [0-9a-f]{4})?) *\t(.*)$", listing, re.MULTILINE)
    halfwords = [(int(address, 16), code.split(), text) for address, code, text in rows]
    return [
        (address, b"".join(int(half, 16).to_bytes(2, "little") for half in code), text)
        for address, code, text in halfwords
    ]
