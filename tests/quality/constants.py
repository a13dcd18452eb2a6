"""The private constants of the core: what they are, and the row that pins each.

    python tests/quality/constants.py

prints them as a table. The results of a row of `lever envelope` or `lever faults` in the brackets of a comment are
known to depend on the constant: to change it, run these first. Constants without a row are round values.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parent.parent)

from lever_cdkf.cli.tables import Row, print_tables
from quality import definitions

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
FOLDERS = ("math", "model", "filter", "bounce", "app")
_DEFINE = re.compile(r"^#define (\w+) +(-?\d[\w.+-]*)(?: +/\* (.*?) \*/)?$", re.MULTILINE)
_BRACKETS = re.compile(r"\[([^\]]*)\]")
_UNIT = re.compile(r"^(?:1|(?:(?:1/)?(?:sqrt\()?(?:rad|s|m|N|g|dB|Hz|us|unit)\b[\^\d/)√ ]*)+)$")


@dataclass(frozen=True)
class Constant:
    """A number that the source gives a name."""

    name: str
    value: str
    file: str
    meaning: str
    """Its comment; empty without one."""

    @property
    def rows(self) -> list[str]:
        """The rows that pin it, in brackets that are no unit."""
        found = [text for text in _BRACKETS.findall(self.meaning) if not _UNIT.match(text)]
        return [row.strip() for text in found for row in text.split(",")]


def constants() -> Iterator[Constant]:
    """Yield all, by folder and file; thresholds of evidence.def are among them."""
    for folder in FOLDERS:
        for path in sorted((FIRMWARE / folder).glob("*.[ch]")):
            file = str(path.relative_to(FIRMWARE))
            for name, value, meaning in _DEFINE.findall(path.read_text(encoding="utf-8")):
                yield Constant(name, value, file, meaning)
    for name, value, *_, meaning in definitions.rows("evidence"):
        yield Constant(name, value, "app/evidence.def", meaning)


def main() -> int:
    """Print the table."""
    rows: list[Row] = [
        {
            "constant": each.name,
            "value": each.value,
            "file": each.file,
            "pinned by": ", ".join(each.rows),
            "is": each.meaning,
        }
        for each in constants()
    ]
    print_tables({"private constants of the core": rows})
    return 0


if __name__ == "__main__":
    sys.exit(main())
