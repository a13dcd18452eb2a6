"""The most stack that a call of the façade can take, from the compiler's call graph (gcc -fcallgraph-info=su).

What the graph leaves open is resolved so:
- A call through a pointer may reach every function whose address stands in a constant table of the caller's own file,
  or of a folder below the caller's (firmware/README.md: who includes whom): from filter/ the models' functions, from
  app/link.c its encoders too.
- A function of the C library takes all that its instructions push, whatever path they take.
A graph with a circle, a frame without a bound, or a call that cannot be resolved is refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lever_cdkf.host_tools.errors import LeverError

from .image import core_objects, run_tool

FOLDERS = ("math", "model", "can", "filter", "app")
"""From the bottom up; nothing calls upwards but through a pointer that it was given."""

_INDIRECT = "__indirect_call"
_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?\\n(\d+) bytes \((\w+)[^)]*\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
_TABLE = re.compile(r"RELOCATION RECORDS FOR \[\.(?:rodata|data)[^\]]*\]:\n(?:OFFSET.*\n)?((?:[0-9a-f]{8} .*\n)*)")
_ENTRY = re.compile(r"^[0-9a-f]{8} R_ARM_ABS32\s+(\w+)$", re.MULTILINE)
_PUSH = re.compile(
    r"\t(?:push|stmdb\s+sp!,|v?push(?:\.w)?)\s*\{([^}]*)\}|\tsub(?:\.w|w)?\s+sp, (?:sp, )?#(\d+)|\[sp, #-(\d+)\]!"
)


@dataclass
class _Function:
    file: str
    frame: int
    calls: set[str] = field(default_factory=set)


@dataclass(frozen=True)
class Deepest:
    """The deepest chain of calls from a function, itself first, with the bytes of each frame."""

    bytes: int
    chain: tuple[tuple[str, int], ...]


class CallGraph:
    """The functions of the core; a name is "filter/dual.c:is_joint" when static, else as the linker sees it."""

    def __init__(self, objects: Mapping[str, Path], elf: Path) -> None:
        """`objects`: the object file of each source file, with its .ci beside it; `elf`: what they are linked into."""
        self._elf = elf
        self._functions: dict[str, _Function] = {}
        self._tables: dict[str, set[str]] = {}
        self._known: dict[str, Deepest] = {}
        for file, path in objects.items():
            self._read(file, path)

    def _read(self, file: str, path: Path) -> None:
        """Functions, frames and calls of one source file, and the functions in its constant tables."""
        text = path.with_suffix(".ci").read_text(encoding="utf-8")
        names = {title: f"{file}:{title.rpartition(':')[2]}" if ":" in title else title for title in self._titles(text)}
        for title, frame, kind in _NODE.findall(text):
            if kind != "static":
                raise LeverError(f"{names[title]}: its stack frame has no bound ({kind})")
            self._functions[names[title]] = _Function(file, int(frame))
        for source, target in _EDGE.findall(text):
            self._functions[names[source]].calls.add(names[target])
        entries = {
            entry for table in _TABLE.findall(run_tool("objdump", "-r", path)) for entry in _ENTRY.findall(table)
        }
        local = {name.rpartition(":")[2]: name for name, function in self._functions.items() if function.file == file}
        self._tables[file] = {local[entry] for entry in entries if entry in local}

    @staticmethod
    def _titles(text: str) -> set[str]:
        return {title for edge in _EDGE.findall(text) for title in edge} | {node[0] for node in _NODE.findall(text)}

    def deepest(self, name: str, above: tuple[str, ...] = ()) -> Deepest:
        """The deepest chain of calls from a function on. Raises LeverError."""
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
        callees = function.calls - {_INDIRECT}
        if _INDIRECT in function.calls:
            reached = self._reached_from(function.file)
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
    """Bytes that all instructions of a function push, and whether it may call (or is not there)."""
    code = run_tool("objdump", "-d", "--no-show-raw-insn", f"--disassemble={name}", elf)
    pushed = sum(_pushed(registers, subtracted or stored) for registers, subtracted, stored in _PUSH.findall(code))
    return pushed, f"<{name}>:" not in code or re.search(r"\tbl\s", code) is not None


def _pushed(registers: str, count: str) -> int:
    """Bytes of a push of {r4, r5-r7, lr}, or of a step down by a number."""
    if count:
        return int(count)
    total = 0
    for item in registers.split(","):
        first, _, last = item.strip().partition("-")
        width = 8 if first.startswith("d") else 4
        total += width * (int(last[1:]) - int(first[1:]) + 1 if last else 1)
    return total


def worst_case(elf: Path, facade: list[str]) -> dict[str, Deepest]:
    """The deepest chain of each function of the façade. Raises LeverError."""
    graph = CallGraph(core_objects(elf), elf)
    return {name: graph.deepest(name) for name in facade}
