"""A dual step takes no more than a microsecond on the host, and callgrind counts what is executed."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from benchmark import benchmark


@pytest.fixture
def program(build_dir: Path) -> Path:
    return build_dir / "tests/lever_benchmark"


def test_a_dual_step_takes_at_most_a_microsecond(program: Path) -> None:
    """The best of twenty rounds, as a machine that also does other things cannot be asked for each."""
    result = benchmark.measure(program, "dual", "lever", None)
    assert 50.0 < result.best_ns <= benchmark.LIMIT_NS
    assert result.best_ns <= result.median_ns


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
