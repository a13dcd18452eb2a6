"""What the core occupies: bytes of its sections, and of an instance."""

from __future__ import annotations

import re
from pathlib import Path

from .image import core_objects, run_tool
from .stack import of_image

_SECTION = re.compile(r"^\.(text|rodata|data|bss)(?:\.\S*)?\s+(\d+)\s", re.MULTILINE)
_TYPE = r"DW_TAG_{kind}_type\)\s+<\w+>\s+DW_AT_name\s+:[^\n]*\b{name}\s+<\w+>\s+DW_AT_byte_size\s+: (\d+)"


RECORDER = ("app/state.c", "app/recorder.c", "can/messages_snapshot.c")
"""What only an image that sends snapshots has."""


def of_core(elf: Path) -> dict[str, int]:
    """Return bytes of text, rodata, data and bss of the core without the recorder, and as "recorder" of both kinds
    of flash of that: of text what is linked into the image, which has all of the façade; of the others what is in
    the library."""
    total = dict.fromkeys(("text", "rodata", "data", "bss", "recorder"), 0)
    texts = of_files(elf)
    for name, path in core_objects(elf).items():
        found = dict.fromkeys(total, 0)
        for kind, count in _SECTION.findall(run_tool("size", "-A", path)):
            found[kind] += int(count)
        found["text"] = texts.get(name, 0)
        if name in RECORDER:
            found["recorder"], found["text"], found["rodata"] = found["text"] + found["rodata"], 0, 0
        for kind, count in found.items():
            total[kind] += count
    return total


def of_files(elf: Path) -> dict[str, int]:
    """Return bytes of text by source file ("filter/cdkf.c"), as far as its functions have not been taken into
    others."""
    return of_image(elf).text_by_file()


def of_instance(elf: Path) -> dict[str, int]:
    """Return bytes of struct lever and of the union lever_memory that has to hold it, from the debugging
    information: nobody outside of the core knows the former."""
    output = run_tool("readelf", "--debug-dump=info", core_objects(elf)["app/lever.c"])
    found = {}
    for kind, name in (("structure", "lever"), ("union", "lever_memory")):
        size = re.search(_TYPE.format(kind=kind, name=name), output)
        assert size is not None, f"no {kind} {name} in app/lever.c"
        found[name] = int(size[1])
    return found
