"""`budget profile`: where the instructions of a step go, by function, source line and kind of instruction."""

from __future__ import annotations

import argparse
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from lever_cdkf.cli.tables import Row, Tables, print_tables
from lever_cdkf.errors import LeverError
from numpy.typing import NDArray

from . import image
from .cycles import Instruction
from .recording import record
from .trace import Trace, disassemble, functions, trace


def run(args: argparse.Namespace) -> int:
    """Return the command. Raise LeverError."""
    recording = record(args.model)
    first, last = _window(args.window, len(recording.samples))
    elf = image.build(args.build, args.firmware, args.flags)
    traced = trace(elf, recording, args.model, args.estimator, args.form, first, last)
    chosen = _choose(traced, args.worst)
    instructions, operations, cycles = (
        each[chosen] for each in (traced.instructions, traced.operations, traced.cycles)
    )
    print(
        f"{args.estimator} {args.model} {args.form}: {len(chosen)} samples from {(first + chosen[0]) * 1e-3:.3f} s on, "
        f"mean {instructions.mean():.1f} instructions, {cycles.mean():.1f} cycles and {operations.mean():.1f} "
        f"floating-point operations, {instructions.min()} to {instructions.max()} instructions"
    )
    print_tables(tables(elf, traced, chosen, args.lines), args.json)
    return 0


def _window(text: str, count: int) -> tuple[int, int]:
    """Return first and last sample of "FROM:TO" in seconds, at 1 kHz. Raises LeverError."""
    try:
        first, end = (round(1000.0 * float(time)) for time in text.split(":"))
    except ValueError:
        raise LeverError(f"--window {text}: two times in seconds are needed, such as 2:3") from None
    if not 0 <= first < end <= count:
        raise LeverError(f"--window {text}: must lie in the recording, 0:{count * 1e-3:g}")
    return first, end - 1


def _choose(traced: Trace, worst: bool) -> list[int]:
    """Return indices of the samples that are looked at."""
    return [int(np.argmax(traced.instructions))] if worst else list(range(len(traced.instructions)))


Spent = NDArray[np.float64]
"""Instructions, cycles and floating-point operations a step."""


@dataclass(frozen=True)
class Frame:
    """A function, or one that was inlined, and a line of it."""

    function: str
    file: str
    line: int


def _frames(elf: Path, addresses: list[int]) -> dict[int, list[Frame]]:
    """Return the frames of each address, innermost first; more than one where functions were inlined."""
    command = [image.tool("addr2line"), "--inlines", "--functions", "--addresses", f"--exe={elf}"]
    asked = "\n".join(map(hex, addresses))
    output = subprocess.run(command, input=asked, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    found: dict[int, list[Frame]] = {}
    frames: list[Frame] = []
    lines = iter(output)
    for text in lines:
        if text.startswith("0x"):
            frames = found.setdefault(int(text, 16), [])
            continue
        file, _, line = next(lines).partition(" (")[0].rpartition(":")
        frames.append(Frame(text, file, int(line) if line.isdigit() else 0))
    return found


def _kind(instruction: Instruction) -> str:
    name = instruction.mnemonic.split(".")[0]
    if instruction.operations:
        division = name.startswith(("vdiv", "vsqrt"))
        return "float: divide, square root" if division else "float: add, subtract, multiply"
    if name.startswith(("vldr", "vstr", "vldm", "vstm", "vpush", "vpop")):
        return "float: load, store"
    if name.startswith(("vcmp", "vmrs")):
        return "float: compare"
    if name.startswith("v"):
        return "float: move, convert, sign"
    if name.startswith(("ldr", "ldm", "pop")):
        return "load"
    if name.startswith(("str", "stm", "push")):
        return "store"
    if name.startswith(("b", "cb", "tb")) and not name.startswith(("bic", "bfi", "bfc")):
        return "branch, call"
    if name.startswith("it"):
        return "condition (it)"
    return "integer"


@cache
def _text(file: str) -> tuple[str, ...]:
    path = Path(file)
    return tuple(path.read_text(encoding="utf-8").splitlines()) if path.is_file() else ()


def _source(file: str, line: int) -> str:
    lines = _text(file)
    return lines[line - 1].strip()[:80] if 0 < line <= len(lines) else ""


def _place(file: str) -> str:
    """Return the last two parts of a path: filter/cdkf.c."""
    return "/".join(file.split("/")[-2:])


def tables(elf: Path, traced: Trace, samples: list[int], lines: int) -> Tables:
    """Instructions, cycles and floating-point operations, as means over the samples; `lines` of the source, the
    busiest."""
    total, cycles = traced.executed(samples)
    code = disassemble(elf)
    frames = _frames(elf, sorted(total))
    symbols = functions(elf)
    by: dict[str, dict[str, Spent]] = {"function": {}, "inlined": {}, "inclusive": {}, "line": {}, "kind": {}}

    for address, times in total.items():
        instruction = code[address]
        spent = np.array([times, cycles[address], times * instruction.operations]) / len(samples)

        def add(table: str, key: str, spent: Spent = spent) -> None:
            by[table][key] = by[table].get(key, 0.0) + spent

        symbol = next((name for begin, size, name in symbols if begin <= address < begin + size), "?")
        stack = frames[address]
        add("function", f"{symbol} ({_place(stack[-1].file)})")
        add("inlined", f"{stack[0].function} ({_place(stack[0].file)})")
        for function in {frame.function for frame in stack}:
            add("inclusive", function)
        inner = stack[0]
        add("line", f"{_place(inner.file)}:{inner.line}  {_source(inner.file, inner.line)}")
        add("kind", _kind(instruction))
    whole = sum(cycles.values()) / len(samples)
    titles = {
        "function": "By function (what was inlined into it included, what it calls not)",
        "inclusive": "By function, itself wherever it was inlined and what was inlined into it",
        "inlined": "By function, itself only",
        "line": f"By source line, the busiest {lines}",
        "kind": "By kind of instruction",
    }
    return {title: _rows(by[name], whole, lines if name == "line" else None) for name, title in titles.items()}


def _rows(entries: dict[str, Spent], whole: float, most: int | None) -> list[Row]:
    """`whole`: cycles a step."""
    ordered = sorted(entries.items(), key=lambda entry: -entry[1][1])[:most]
    return [
        {
            "instructions a step": round(float(instructions), 1),
            "cycles": round(float(cycles), 1),
            "share [%]": round(100.0 * float(cycles) / whole, 1),
            "float operations": round(float(operations), 1),
            "where": name,
        }
        for name, (instructions, cycles, operations) in ordered
        if instructions >= 0.05
    ]
