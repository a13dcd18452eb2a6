"""What the core occupies: bytes of its sections, and of an instance."""

from __future__ import annotations

import re
from pathlib import Path

from .image import core_objects, run_tool
from .stack import of_image

_SECTION = re.compile(r"^\.(text|rodata|data|bss)(?:\.\S*)?\s+(\d+)\s", re.MULTILINE)
_TYPE = r"DW_TAG_{kind}_type\)\s+<\w+>\s+DW_AT_name\s+:[^\n]*\b{name}\s+<\w+>\s+DW_AT_byte_size\s+: (\d+)"


def of_core(elf: Path) -> dict[str, int]:
    """Bytes of text, rodata, data and bss of the core: of text what is linked into the image, which has all of the
    façade; of the others what is in the library."""
    total = dict.fromkeys(("text", "rodata", "data", "bss"), 0)
    for path in core_objects(elf).values():
        for kind, count in _SECTION.findall(run_tool("size", "-A", path)):
            total[kind] += int(count)
    return total | {"text": sum(of_files(elf).values())}


def of_files(elf: Path) -> dict[str, int]:
    """Bytes of text by source file ("filter/cdkf.c"), as far as its functions have not been taken into others."""
    return of_image(elf).text_by_file()


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
