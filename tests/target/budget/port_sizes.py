"""What the callbacks of port/port.h take on the STM32F405, with all they call: bytes and lines of C."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from .image import FIRMWARE, run_tool
from .trace import functions

FUNCTIONS = {
    "receive": "transport_receive",
    "send": "transport_send",
    "wait": "wait_frame",
    "status": "report_status",
}
"""The callbacks, and which function each is."""
TRANSPORTS = {"can": ("transport_slcan.c", "usart.c", "slcan.c"), "slcan": ("transport_can.c", "can.c")}
"""The images, and the files that are not in each."""

_PORT = FIRMWARE / "port"
_FOLDERS = ("stm32f4", "embedded", "slcan")
_DEFINITION = re.compile(r"^(?:[a-z_][\w *]*[ *])?(\w+)\([^;{}()]*\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_FUNCTION = re.compile(r"^[0-9a-f]+ <([^>+]+)>:\n((?:.+\n)*)", re.MULTILINE)
_CALL = re.compile(r"\tb(?:l|\.[nw]|)\s+[0-9a-f]+ <([^>+]+)>")
_NAME = re.compile(r"\b(\w+)\(")


@dataclass(frozen=True)
class Size:
    """Of a part of a port."""

    bytes: int
    lines: int
    """Of C, without blank lines and comments."""


def of_port(transport: str, elf: Path) -> dict[str, Size]:
    """Return each of FUNCTIONS with all of the port that it calls, and "all" of the port in an image. Raises
    LeverError.

    Bytes are those of the functions in the image, lines those of the functions in the source: what was inlined counts
    where it is."""
    bodies = _bodies(transport)
    lines = {name: 3 + sum(bool(line.strip()) for line in body.splitlines()) for name, body in bodies.items()}
    in_source = {name: set(_NAME.findall(body)) & set(bodies) for name, body in bodies.items()}
    in_image = {name: set(_CALL.findall(body)) for name, body in _FUNCTION.findall(run_tool("objdump", "-d", elf))}
    bytes_of = {name: size for _, size, name in functions(elf) if name in bodies}
    sizes = {}
    for callback, name in FUNCTIONS.items():
        reached = _reached(name, in_image) & set(bytes_of)
        sizes[callback] = Size(
            sum(bytes_of[each] for each in reached), sum(lines[each] for each in _reached(name, in_source))
        )
    return sizes | {"all": Size(sum(bytes_of.values()), sum(lines.values()))}


def _reached(name: str, calls: dict[str, set[str]]) -> set[str]:
    found: set[str] = set()
    waiting = {name}
    while waiting:
        found |= waiting
        waiting = {callee for each in waiting for callee in calls.get(each, ())} - found
    return found


def _bodies(transport: str) -> dict[str, str]:
    """Return the body of every function in the sources of the port, without comments."""
    found: dict[str, str] = {}
    for folder in _FOLDERS:
        for file in sorted((_PORT / folder).glob("*.[ch]")):
            if file.name not in TRANSPORTS[transport]:
                text = re.sub(r"/\*.*?\*/", "", file.read_text(encoding="utf-8"), flags=re.DOTALL)
                found |= dict(_DEFINITION.findall(text))
    return found
