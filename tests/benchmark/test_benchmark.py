"""Callgrind counts what a step of the estimator executes; how long that takes is no test's to ask."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from benchmark import benchmark, visits


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


def test_visits_are_counted_by_sample_file_and_module() -> None:
    names = ["lever_update", "step", "lesser", "evidence_end_block", "helper"]
    files = ["/firmware/app/lever.c", "/firmware/app/step.c", "/firmware/math/bounds.h", "/e.c", "/firmware/app/step.h"]
    first = [0, 1, ~1, 2, ~2, ~0]
    second = [0, 1, 4, 3, ~3, ~4, ~1, ~0]
    trace = [4, ~4, *first, *second]  # what is before a sample does not count
    place = np.array([visit if visit >= 0 else ~visit for visit in trace])
    found = visits.by_sample(place, np.array([visit < 0 for visit in trace]), names, files)
    assert found == [visits.Visit(3, 4, 2, False), visits.Visit(4, 6, 4, True)]
