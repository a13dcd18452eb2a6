"""The tests reach all of the core, its lines, branches and conditions (MC/DC), but for what is excluded."""

from __future__ import annotations

from pathlib import Path

import pytest
from covered import __main__ as command
from covered import measuring

NEEDS = pytest.mark.requires(measuring.COMPILER, measuring.MERGER, measuring.READER)
CORE = """\
int decide(int a, int b);
int unreached(int a);
int decide(int a, int b)
{
    return ((a > 0) && (b > 0)) ? 1 : 0;
}
int unreached(int a)
{
    return a + 1;
}
"""
TEST = "int decide(int a, int b);\nint main(void) { return decide(1, 1) - 1 + decide(0, 1); }\n"


@NEEDS
def test_the_core_is_reached(build_dir: Path, tmp_path: Path) -> None:
    found = measuring.measure(command.sources(build_dir), tmp_path / "built")
    assert [str(each) for each in found.open] == []
    excluded = {each.number for each in found.missing if each.number}
    assert excluded == {each.number for each in measuring.exclusions()}


@NEEDS
def test_what_is_missing_is_found(tmp_path: Path) -> None:
    core, test = tmp_path / "core.c", tmp_path / "test_core.c"
    core.write_text(CORE, encoding="utf-8")
    test.write_text(TEST, encoding="utf-8")
    found = measuring.measure(measuring.Sources([core], [], [test], []), tmp_path / "built")
    shown = {(each.kind, each.line, each.number) for each in found.missing}
    assert shown == {
        ("branches", 5, ""), ("mcdc", 5, ""), ("lines", 8, ""), ("lines", 9, ""), ("lines", 10, "")
    }  # fmt: skip
    assert found.count["mcdc"] == 2
