"""Callgrind counts what a step of the estimator executes; how long that takes is no test's to ask."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from benchmark import benchmark


@pytest.fixture
def program(build_dir: Path) -> Path:
    return build_dir / "tests/lever_benchmark"


@pytest.mark.requires("valgrind")
def test_callgrind_counts_the_instructions_of_the_step_only(program: Path) -> None:
    """As a Cortex-M4F, within a factor: the arithmetic is the same."""
    valgrind = shutil.which("valgrind")
    dual, joint = (
        benchmark.measure(program, estimator, "lever", valgrind).instructions for estimator in ("dual", "joint")
    )
    assert dual is not None
    assert joint is not None
    assert 500.0 < dual < 5000.0
    assert 0.9 * dual < joint < 2.0 * dual
