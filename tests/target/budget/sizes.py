"""What the core occupies: bytes of its sections, and of an instance."""

from __future__ import annotations

import re
from pathlib import Path

from .image import core_library, core_objects, run_tool

_SECTION = re.compile(r"^\.(text|rodata|data|bss)(?:\.\S*)?\s+(\d+)\s", re.MULTILINE)
_TYPE = r"DW_TAG_{kind}_type\)\s+<\w+>\s+DW_AT_name\s+:[^\n]*\b{name}\s+<\w+>\s+DW_AT_byte_size\s+: (\d+)"


def of_library(elf: Path) -> dict[str, int]:
    """Bytes of text, rodata, data and bss in the core's static library, whether a program needs all of it or not."""
    total = dict.fromkeys(("text", "rodata", "data", "bss"), 0)
    for kind, count in _SECTION.findall(run_tool("size", "-A", core_library(elf))):
        total[kind] += int(count)
    return total


def of_files(elf: Path) -> dict[str, dict[str, int]]:
    """Bytes of text and rodata by source file ("filter/dual.c")."""
    found = {}
    for name, path in core_objects(elf).items():
        found[name] = dict.fromkeys(("text", "rodata"), 0)
        for kind, count in _SECTION.findall(run_tool("size", "-A", path)):
            if kind in found[name]:
                found[name][kind] += int(count)
    return found


def of_instance(elf: Path) -> dict[str, int]:
    """Bytes of struct lever and of the union lever_memory that has to hold it, from the debugging information: nobody
    outside of the core knows the former."""
    output = run_tool("readelf", "--debug-dump=info", core_objects(elf)["app/lever.c"])
    found = {}
    for kind, name in (("structure", "lever"), ("union", "lever_memory")):
        size = re.search(_TYPE.format(kind=kind, name=name), output)
        assert size is not None, f"no {kind} {name} in app/lever.c"
        found[name] = int(size[1])
    return found
