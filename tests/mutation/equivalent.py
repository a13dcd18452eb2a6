"""Mutants that change nothing that can be seen, each with the reason, from equivalent.txt.

A line that begins with # is the reason of those below it. One of these is named by file, function and change, with (2)
when it is the second of that name, so that it keeps its name when lines move.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from .schemata import Mutant

FILE = Path(__file__).with_name("equivalent.txt")


def named(mutants: Iterable[Mutant]) -> dict[str, Mutant]:
    """Return all mutants of the core by name."""
    seen: Counter[str] = Counter()
    names = {}
    for each in mutants:
        name = f"{each.path}: {each.function}(): {each.before} -> {each.after or '(dropped)'}"
        seen[name] += 1
        names[name if seen[name] == 1 else f"{name} ({seen[name]})"] = each
    return names


def equivalents(mutants: Iterable[Mutant]) -> dict[int, str]:
    """Return the reason by number. Raise LookupError for a name that no mutant has, or one that stands there twice."""
    names, reasons, reason = named(mutants), {}, ""
    for line in FILE.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            reason = line.removeprefix("#").strip()
        elif line:
            if line not in names or names[line].number in reasons:
                raise LookupError(f"{FILE.name}: no such mutant, or twice: {line}")
            reasons[names[line].number] = reason
    return reasons
