"""The tables of firmware/app/*.def, as a reader gets to see them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

APP = Path(__file__).resolve().parents[2] / "firmware/app"


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
