"""The last step of building an image: puts the CRC-32 of its flash into it, writes .hex and .bin, and says its size.

The linker script leaves four bytes for the CRC behind everything else in flash (section .rom_crc); rom.c checks it.
"""

from __future__ import annotations

import argparse
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import NamedTuple

FLASH_BYTES = 1024 * 1024
RAM_BYTES = 128 * 1024
IN_FLASH = (".text", ".data", ".rom_crc")
IN_RAM = (".stack", ".data", ".bss", ".noinit")


class Section(NamedTuple):
    """A section of the image."""

    size: int
    load_address: int


def sections(elf: Path, objdump: str) -> dict[str, Section]:
    """Return size and load address of each section, by the table that objdump prints."""
    table = subprocess.run([objdump, "-h", "-w", elf], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in table.splitlines() if line.strip()[:1].isdigit()]
    return {row[1]: Section(int(row[2], 16), int(row[4], 16)) for row in rows}


def put_crc(elf: Path, objcopy: str, objdump: str) -> None:
    """Fill .rom_crc of `elf`. Exits with a line when flash is not in one piece."""
    flash = elf.with_suffix(".flash")
    crc = elf.with_suffix(".crc")
    try:
        subprocess.run([objcopy, "-O", "binary", "--remove-section=.rom_crc", elf, flash], check=True)
        contents = flash.read_bytes()
        by_name = sections(elf, objdump)
        if len(contents) != by_name[".rom_crc"].load_address - by_name[".text"].load_address:
            sys.exit(f"{elf}: there is a gap between sections in flash, or between them and the CRC: see image.ld")
        crc.write_bytes(struct.pack("<I", zlib.crc32(contents)))
        subprocess.run([objcopy, f"--update-section=.rom_crc={crc}", elf], check=True)
    finally:
        flash.unlink(missing_ok=True)
        crc.unlink(missing_ok=True)


def report(elf: Path, objdump: str) -> str:
    """Return what the image takes of flash and RAM [bytes], in a line."""
    by_name = sections(elf, objdump)
    flash = sum(by_name[name].size for name in IN_FLASH)
    ram = sum(by_name[name].size for name in IN_RAM)
    return (
        f"-- {elf.name}: flash {flash} of {FLASH_BYTES} bytes ({100 * flash / FLASH_BYTES:.1f} %), "
        f"RAM {ram} of {RAM_BYTES} bytes ({100 * ram / RAM_BYTES:.1f} %), "
        f"of which {by_name['.stack'].size} are reserved for the stack"
    )


def main() -> None:
    """Put the checksum into the image, write it as .hex and .bin too, and print what it takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("elf", type=Path)
    parser.add_argument("--objcopy", default="arm-none-eabi-objcopy")
    parser.add_argument("--objdump", default="arm-none-eabi-objdump")
    args = parser.parse_args()
    put_crc(args.elf, args.objcopy, args.objdump)
    for form, suffix in (("ihex", ".hex"), ("binary", ".bin")):
        subprocess.run([args.objcopy, "-O", form, args.elf, args.elf.with_suffix(suffix)], check=True)
    print(report(args.elf, args.objdump), flush=True)


if __name__ == "__main__":
    main()
