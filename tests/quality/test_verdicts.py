"""The tables of firmware/app/README.md and the names in lever.dbc are those of evidence.def and verdict.def."""

from __future__ import annotations

import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.estimator import TEST_RATIOS
from quality.definitions import APP, rows

COLUMNS = {
    "verdict": (
        "verdict",
        "because of",
        "learn",
        "adapt",
        "torque",
        "correction",
        "margin",
        "on entry",
        "on exit",
        "is",
    ),
    "evidence": ("evidence", "threshold", "off", "shows as", "is"),
}


def table(name: str) -> str:
    lines = [COLUMNS[name], ["---"] * len(COLUMNS[name]), *rows(name)]
    return "\n".join(f"| {' | '.join(cells)} |".replace("|  |", "| |").replace("|  |", "| |") for cells in lines)


@pytest.mark.parametrize("name", COLUMNS)
def test_the_readme_prints_the_table(name: str) -> None:
    assert table(name) in (APP / "README.md").read_text(encoding="utf-8"), f"put this there:\n{table(name)}"


def test_the_contract_has_the_same_names() -> None:
    """States, which have no statistic, are left out."""
    statistics = [first for first, *_, meaning in rows("evidence") if not meaning.startswith("state")]
    assert list(codec.choices("TEST_RATIO", "evidence").values()) == statistics == list(TEST_RATIOS)
    assert list(codec.choices("TEST_RATIO", "verdict").values()) == [first for first, *_ in rows("verdict")]
