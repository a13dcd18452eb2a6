"""Requirements of firmware/REQUIREMENTS.md and SECURITY.md, and the tests that carry their numbers."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_ROW = re.compile(r"^\| ([RS]\d+) \| (.+) \|$", re.MULTILINE)
_C_TEST = re.compile(r"/\* ([RS]\d+(?: [RS]\d+)*) \*/\nTEST(?:_EACH)?\((?:.*?, )?(\w+)\)")


@dataclass(frozen=True)
class Trace:
    """A test that says that it proves a requirement."""

    requirement: str
    path: str
    test: str


def requirements() -> dict[str, str]:
    """Return number and words of each."""
    texts = ((ROOT / "firmware" / name).read_text(encoding="utf-8") for name in ("REQUIREMENTS.md", "SECURITY.md"))
    found = [row for text in texts for row in _ROW.findall(text)]
    assert len(dict(found)) == len(found), "a number stands twice"
    return dict(found)


def traces(tests: Path = ROOT / "tests") -> list[Trace]:
    """Return the traces of all tests."""
    return [*_of_c(tests), *_of_python(tests)]


def _of_c(tests: Path) -> Iterator[Trace]:
    for file in sorted(tests.glob("unit/*/test_*.c")):
        for numbers, name in _C_TEST.findall(file.read_text(encoding="utf-8")):
            yield from (Trace(number, str(file.relative_to(ROOT)), name) for number in numbers.split())


def _of_python(tests: Path) -> Iterator[Trace]:
    for file in sorted(tests.rglob("test_*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef):
                for number in _marks(node):
                    yield Trace(number, str(file.relative_to(ROOT)), node.name)


def _marks(function: ast.FunctionDef) -> Iterator[str]:
    for mark in function.decorator_list:
        if isinstance(mark, ast.Call) and isinstance(mark.func, ast.Attribute) and mark.func.attr == "requirement":
            yield from (str(ast.literal_eval(argument)) for argument in mark.args)
