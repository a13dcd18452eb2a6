"""Each requirement has a test, and each number in a test is a requirement."""

from __future__ import annotations

import re

import pytest
from quality import tools, tracing

MOST = 60


@pytest.fixture(scope="module")
def required() -> dict[str, str]:
    return tracing.requirements()


@pytest.fixture(scope="module")
def traces() -> list[tracing.Trace]:
    return tracing.traces()


def test_every_requirement_has_a_test_and_every_number_a_requirement(
    required: dict[str, str], traces: list[tracing.Trace]
) -> None:
    assert {trace.requirement for trace in traces} == set(required)


def test_they_are_few_and_numbered_without_a_gap(required: dict[str, str]) -> None:
    for letter in "RS":
        own = [number for number in required if number[0] == letter]
        assert own == [f"{letter}{i}" for i in range(1, len(own) + 1)]
        assert len(own) <= MOST


def test_every_mark_in_c_is_at_a_test(traces: list[tracing.Trace]) -> None:
    files = (tools.ROOT / "tests/unit").glob("*/test_*.c")
    marks = sum(len(re.findall(r"/\* [RS]\d", file.read_text(encoding="utf-8"))) for file in files)
    c_tests = {(trace.path, trace.test) for trace in traces if trace.path.endswith(".c")}
    assert marks == len(c_tests)
