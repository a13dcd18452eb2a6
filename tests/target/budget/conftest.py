"""What the tests of this folder share: the image of this tree, its runs, and the budget."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from conftest import Built
from target.budget import image, measure


@pytest.fixture(scope="session")
def elf(built: Built) -> Path:
    return built("target/image/budget.elf", "build.budget")


@pytest.fixture(scope="session")
def runs(elf: Path) -> dict[measure.Case, image.Run]:
    return measure.run_all(elf)


@pytest.fixture(scope="session")
def budget(elf: Path, runs: dict[measure.Case, image.Run], build_dir: Path) -> dict[str, Any]:
    """Written to build/target/budget.json too, as `cmake --workflow --preset target` does."""
    measured = measure.budget(elf, image.FIRMWARE, runs)
    (build_dir / "target/budget.json").write_text(json.dumps(measured, indent=2) + "\n", encoding="utf-8")
    return measured
