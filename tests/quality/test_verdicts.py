"""The tables of firmware/app/README.md and the names in lever.dbc are those of evidence.def and verdict.def."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from lever_cdkf.can import codec
from lever_cdkf.firmware.estimator import TEST_RATIOS
from quality import tools

APP = tools.FIRMWARE / "app"
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


def rows(name: str) -> Iterator[list[str]]:
    """Yield the cells of each row of NAME.def, as a reader gets to see them."""
    text = (APP / f"{name}.def").read_text(encoding="utf-8")
    for arguments in re.findall(rf"^{name.upper()}\((.*)\)$", text, re.MULTILINE):
        *cells, meaning = re.fullmatch(r'(.*), "(.*)"', arguments).groups()  # type: ignore[union-attr]
        yield [*(cell(each) for each in cells[0].split(", ")), meaning]


def cell(text: str) -> str:
    """Return a cell of a .def file in words."""
    words = re.sub(r"ON\(EVIDENCE_(\w+)\)", r"\1", text)
    words = words.replace("(uint32_t)", "")
    words = re.sub(r"\b(EVIDENCE|VERDICT|LEVER_FAULT)_", "", words).replace(" |", ",")
    number = re.fullmatch(r"(-?[\d.]+)f", words)
    return {"NOTHING": "", "NEVER": "", "0": "", "0u": "", "1": "yes", "ALWAYS": "yes"}.get(
        words, f"{float(number[1]):g}" if number else words.lower()
    )


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
