"""The most stack that a call of the façade can take, from the compiler's call graph (gcc -fcallgraph-info=su) of the
program as it is linked: a function may have been taken into its caller, from another file, too.

What the graph leaves open is resolved so:
- A call through a pointer may reach every function whose address stands in a constant table of the file that the call
  is written in, or of a folder below it (firmware/README.md: who includes whom): from filter/ the models' functions,
  from app/link.c its encoders too.
- A function of the C library takes all that its instructions push, whatever path they take.
A graph with a circle, a frame without a bound, or a call that cannot be resolved is refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lever_cdkf.errors import LeverError

from .image import call_graph, core_objects, run_tool

FOLDERS = ("math", "model", "can", "filter", "bounce", "app")
"""From the bottom up; nothing calls upwards but through a pointer that it was given."""

_INDIRECT = "__indirect_call"
_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"\\]*\\n([^"\\]*?):\d+:\d+\\n(\d+) bytes \((\w+)[^)]*\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"(?: label: "([^"]*?):\d+:\d+")?')
_TABLE = re.compile(r"RELOCATION RECORDS FOR \[\.(?:rodata|data)[^\]]*\]:\n(?:OFFSET.*\n)?((?:[0-9a-f]{8} .*\n)*)")
_ENTRY = re.compile(r"^[0-9a-f]{8} R_ARM_ABS32\s+(\w+)$", re.MULTILINE)
_SYMBOL = re.compile(r"^\w+ (\w+) [tTwW] (\S+)$", re.MULTILINE)
_PUSH = re.compile(
    r"\t(?:push|stmdb\s+sp!,|v?push(?:\.w)?)\s*\{([^}]*)\}|\tsub(?:\.w|w)?\s+sp, (?:sp, )?#(\d+)|\[sp, #-(\d+)\]!"
)


@dataclass
class _Function:
    file: str
    frame: int
    calls: set[str] = field(default_factory=set)
    points: set[str] = field(default_factory=set)
    """Files that its calls through a pointer are written in."""


@dataclass(frozen=True)
class Deepest:
    """The deepest chain of calls from a function, itself first, with the bytes of each frame."""

    bytes: int
    chain: tuple[tuple[str, int], ...]


class CallGraph:
    """The functions of the core; a name is "filter/cdkf.c:move" when static, else as the linker sees it."""

    def __init__(self, objects: Mapping[str, Path], elf: Path, graph: Path) -> None:
        """`objects`: the object file of each source file; `elf`: what they are linked into; `graph`: its .ci."""
        self._elf = elf
        self._functions: dict[str, _Function] = {}
        self._known: dict[str, Deepest] = {}
        self._read(graph.read_text(encoding="utf-8"))
        self._tables = {file: self._table(file, path) for file, path in objects.items()}

    def _read(self, text: str) -> None:
        """Functions, frames and calls."""
        names: dict[str, str] = {}
        for title, path, frame, kind in _NODE.findall(text):
            file = "/".join(path.split("/")[-2:])
            names[title] = f"{file}:{title.rpartition(':')[2]}" if ":" in title else title
            if kind != "static":
                raise LeverError(f"{names[title]}: its stack frame has no bound ({kind})")
            self._functions[names[title]] = _Function(file, int(frame))
        for source, target, path in _EDGE.findall(text):
            function = self._functions[names[source]]
            if target == _INDIRECT:
                function.points.add("/".join(path.split("/")[-2:]))
            else:
                function.calls.add(names.get(target, target))

    def _table(self, file: str, path: Path) -> set[str]:
        """Return the functions in the constant tables of a source file."""
        entries = {
            entry for table in _TABLE.findall(run_tool("objdump", "-r", path)) for entry in _ENTRY.findall(table)
        }
        own = (name for name, function in self._functions.items() if function.file == file)
        return {name for name in own if name.rpartition(":")[2].partition(".")[0] in entries}

    def text_by_file(self) -> dict[str, int]:
        """Return bytes of code in the image, by the source file of the function that it stands in."""
        sizes = {name: size for size, name in _SYMBOL.findall(run_tool("nm", "--print-size", self._elf))}
        found: dict[str, int] = {}
        for name, function in self._functions.items():
            found[function.file] = found.get(function.file, 0) + int(sizes.get(name.rpartition(":")[2], "0"), 16)
        return found

    def deepest(self, name: str, above: tuple[str, ...] = ()) -> Deepest:
        """Return the deepest chain of calls from a function on. Raise LeverError."""
        if name in above:
            raise LeverError(f"the call graph has a circle: {' > '.join((*above, name))}")
        if name not in self._known:
            frame, below = self._frame(name), [self.deepest(callee, (*above, name)) for callee in self._callees(name)]
            longest = max(below, key=lambda chain: chain.bytes, default=Deepest(0, ()))
            self._known[name] = Deepest(frame + longest.bytes, ((name, frame), *longest.chain))
        return self._known[name]

    def _callees(self, name: str) -> set[str]:
        if name not in self._functions:
            return set()
        function = self._functions[name]
        callees = set(function.calls)
        for file in function.points:
            reached = self._reached_from(file)
            if not reached:
                raise LeverError(
                    f"{name} calls through a pointer, and no constant table that it may use has a function"
                )
            callees |= reached
        return callees

    def _reached_from(self, file: str) -> set[str]:
        folders = FOLDERS[: FOLDERS.index(file.split("/")[0])]
        tables = [table for other, table in self._tables.items() if other == file or other.split("/")[0] in folders]
        return set().union(*tables)

    def _frame(self, name: str) -> int:
        if name in self._functions:
            return self._functions[name].frame
        pushed, calls = pushed_by(self._elf, name)
        if calls:
            raise LeverError(f"{name} is called and is neither in the core nor a leaf of the C library")
        return pushed


def pushed_by(elf: Path, name: str) -> tuple[int, bool]:
    """Return bytes that all instructions of a function push, and whether it may call (or is not there)."""
    code = run_tool("objdump", "-d", "--no-show-raw-insn", f"--disassemble={name}", elf)
    pushed = sum(_pushed(registers, subtracted or stored) for registers, subtracted, stored in _PUSH.findall(code))
    return pushed, f"<{name}>:" not in code or re.search(r"\tbl\s", code) is not None


def _pushed(registers: str, count: str) -> int:
    """Return bytes of a push of {r4, r5-r7, lr}, or of a step down by a number."""
    if count:
        return int(count)
    total = 0
    for item in registers.split(","):
        first, _, last = item.strip().partition("-")
        width = 8 if first.startswith("d") else 4
        total += width * (int(last[1:]) - int(first[1:]) + 1 if last else 1)
    return total


def of_image(elf: Path) -> CallGraph:
    """Return the call graph of the core in the image."""
    return CallGraph(core_objects(elf), elf, call_graph(elf))


def worst_case(elf: Path, facade: list[str]) -> dict[str, Deepest]:
    """Return the deepest chain of each function of the façade. Raise LeverError."""
    graph = of_image(elf)
    return {name: graph.deepest(name) for name in facade}
