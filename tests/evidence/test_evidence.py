"""What tests say becomes the evidence of a requirement: the worst of all, and nothing that was not run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
from evidence import __main__ as command
from evidence import page, results

JUNIT = """<testsuites><testsuite>
<testcase classname="tests.python.can.test_e2e" name="test_protect[1]"/>
<testcase classname="tests.python.can.test_e2e" name="test_protect[2]"><failure message="no"/></testcase>
<testcase classname="tests.quality.test_bit_identity" name="test_same_bits[gcc]"><skipped/></testcase>
<testcase classname="tests.quality.test_bit_identity" name="test_same_bits[clang]"/>
<testcase classname="tests.quality.test_promises" name="test_no_double">
<properties><property name="functions" value="12"/></properties></testcase>
</testsuite></testsuites>"""
ROW = {
    "name": "theta_stuck", "title": "θ stuck", "must": "back in 2 s", "result": "SILENT", "broken": ["silent"],
    "covered": 98.0, "worst": {"silent": 1.5},
}  # fmt: skip
MUTANT = {"path": "can/e2e.c", "line": 7, "function": "f", "before": "a < b", "after": "a <= b"}
CONTENT: dict[str, Any] = {
    "requirements": {
        "count": 2, "untested": 1,
        "rows": [
            {"number": "R1", "requirement": "x < y", "tests": [
                {"test": "tests/a.py::test_a", "verdict": "passed", "cases": 3, "figures": {"error [%]": ["10", "9"]}},
            ]},
            {"number": "R2", "requirement": "z", "tests": [
                {"test": "tests/a.py::test_b", "verdict": "not run", "cases": 0, "figures": {}},
            ]},
        ],
    },
    "fault_rows": {"count": 1, "missed": 1, "unexpected": 0, "silent": 1, "rows": [ROW]},
    "coverage": {
        "lines": 99.5, "branches": 98.0, "mcdc": 96.0, "counts": {"lines": 200, "branches": 100, "mcdc": 50},
        "open": ["a.c:1: never reached"], "excluded": [],
    },
    "mutants": {"valid": 10, "killed": 9, "equivalent": 1, "survivors": [MUTANT]},
    "eva": {"modules": [{"harness": "e2e", "files": ["can/e2e.c"], "alarms": 0, "reached": 100}]},
    "eva_alarms": 0,
    "soak": {"total": {"hour": "all", "NEES": 0.98}, "hours": 24, "memory_growth_mib": 0.1, "troubles": []},
    "fuzz": {"targets": ["slcan"], "seconds": 60, "seeds": {"slcan": 4711}, "found": 0},
    "seconds": {"eva": 11.0},
    "provenance": {"version": "1", "revision": "abc", "created": "today", "library": "sha256:0"},
}  # fmt: skip


def test_of_a_test_with_parameters_the_worst_counts() -> None:
    said = results.read(JUNIT)
    assert {key[1]: (each.verdict, each.cases) for key, each in said.items()} == {
        "test_protect": ("failed", 2), "test_same_bits": ("skipped", 2), "test_no_double": ("passed", 1)
    }  # fmt: skip
    assert said["tests/quality/test_promises.py", "test_no_double"].figures == {"functions": ["12"]}


def test_the_page_says_what_is_proven_and_what_is_not() -> None:
    written = page.build(CONTENT)
    words = ("1 of 2 requirements", "x &lt; y", "not run", "in 1 an estimate is wrong", "9 of 10", "error [%]: 9 to 10")
    for each in (*words, "passed, 3 cases", "a &lt; b → a &lt;= b", "a.c:1: never reached"):
        assert each in written
    assert not page.holds(CONTENT)


def test_a_part_that_cannot_be_gathered_ends_it_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "evidence").mkdir()
    for name in command.FILES:
        (tmp_path / "evidence" / name).write_text("of an earlier run")
    monkeypatch.setattr(command, "TOOLS", ("no-such-tool",))
    monkeypatch.setattr(sys, "argv", ["evidence", str(tmp_path)])
    assert command.main() == 2
    assert "no no-such-tool here" in capsys.readouterr().err
    assert not list((tmp_path / "evidence").iterdir())
