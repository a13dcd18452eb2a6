"""What tests say becomes the evidence of a requirement: the worst of all, and nothing that was not run."""

from __future__ import annotations

from typing import Any

from evidence import page, results

JUNIT = """<testsuites><testsuite>
<testcase classname="tests.python.can.test_e2e" name="test_protect[1]"/>
<testcase classname="tests.python.can.test_e2e" name="test_protect[2]"><failure message="no"/></testcase>
<testcase classname="tests.quality.test_bit_identity" name="test_same_bits[gcc]"><skipped/></testcase>
<testcase classname="tests.quality.test_bit_identity" name="test_same_bits[clang]"/>
<testcase classname="tests.quality.test_promises" name="test_no_double"/>
</testsuite></testsuites>"""
ROW = {
    "name": "theta_stuck", "title": "θ stuck", "must": "back in 2 s", "result": "SILENT", "broken": [], "covered": 98.0,
    "worst": {"silent": 1.5},
}  # fmt: skip
CONTENT: dict[str, Any] = {
    "requirements": {
        "count": 2, "untested": 1,
        "rows": [
            {"number": "R1", "requirement": "x < y", "tests": {"tests/a.py::test_a": "passed"}},
            {"number": "R2", "requirement": "z", "tests": {"tests/a.py::test_b": "not run"}},
        ],
    },
    "fault_rows": {"count": 1, "missed": 0, "silent": 1, "rows": [ROW]},
    "coverage": {"missing": "no llvm-cov-19 here"},
    "mutants": {"valid": 10, "killed": 9},
    "eva": {"modules": {"e2e": ["can/e2e.c"]}},
    "eva_alarms": 0,
}  # fmt: skip


def test_of_a_test_with_parameters_the_worst_counts() -> None:
    assert results.read(JUNIT) == {
        ("tests/python/can/test_e2e.py", "test_protect"): "failed",
        ("tests/quality/test_bit_identity.py", "test_same_bits"): "skipped",
        ("tests/quality/test_promises.py", "test_no_double"): "passed",
    }


def test_the_page_says_what_is_proven_and_what_is_not() -> None:
    written = page.build(CONTENT)
    for words in ("1 of 2 requirements", "x &lt; y", "not run", "in 1 an estimate is wrong without a flag", "9 of 10"):
        assert words in written
