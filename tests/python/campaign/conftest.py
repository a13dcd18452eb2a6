"""A campaign of a second a flight, and its chunks as this process alone makes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from lever_sil.campaign import chunks, spec
from lever_sil.campaign.chunks import Plan
from lever_sil.campaign.spec import Spec

SMALL = """
title = "small"
scenario = "steady"
set = { duration = "1 s", converged_after = "0.4 s" }
seeds = 4
chunk = 1
estimators = ["dual", "rls"]
[[vary]]
key = "pilot.process_noise"
values = ["0.02 rad/s/sqrt(s)", "0.2 rad/s/sqrt(s)", "0.3 rad/s/sqrt(s)"]
[[vary]]
key = "estimator.adaptation"
values = ["fixed", "robbins_monro"]
"""


@pytest.fixture(scope="session")
def small_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """24 flights, 48 runs, 24 chunks."""
    file = tmp_path_factory.mktemp("spec") / "small.toml"
    file.write_text(SMALL)
    return file


@pytest.fixture(scope="session")
def small(small_file: Path) -> Plan:
    return Plan(spec.load(str(small_file)))


@pytest.fixture(scope="session")
def undisturbed(small: Plan, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Return the files of the small campaign: name to content."""
    folder = tmp_path_factory.mktemp("undisturbed")
    for number in range(small.count):
        chunks.make(small, small.chunk(number), folder)
    return files(folder)


@pytest.fixture
def spec_of(tmp_path: Path) -> Callable[[str], Spec]:
    """spec_of(text): the spec of a TOML text."""

    def from_text(text: str) -> Spec:
        file = tmp_path / "made.toml"
        file.write_text(text)
        return spec.load(str(file))

    return from_text


def files(folder: Path) -> dict[str, bytes]:
    """Return the Parquet files of a folder."""
    return {file.name: file.read_bytes() for file in folder.glob("*.parquet")}
