"""The private constants of the core: what they are, and the row that pins each.

    python tests/quality/constants.py                        prints them as a table
    python tests/quality/constants.py --vary [NAME ...]      runs the rows of each with 0.7 and 1.3 of it

The results of a row of `lever envelope` or `lever faults` in the brackets of a comment depend on the constant, which
--vary shows: to change it, run these first. Constants without a row are round values. --vary changes the sources of
this tree, one constant at a time, and puts them back; it needs the build, and takes half an hour for all.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parent.parent)

from lever_cdkf.cli.tables import Row, print_tables
from lever_sil.faults.rows import ROWS
from quality import definitions

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
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


LIBRARIES = {"lever_cdkf": "firmware", "lever_loop": "sil/lever_sil/fast/c"}
"""What `lever envelope` and `lever faults` load, and where it is built."""


def measured(rows: Iterable[str]) -> dict[str, str]:
    """Return what the rows come to, with eight pilots of the envelope and four of the faults."""
    targets = ["lever_cdkf_shared", *(f"{name}_cdef" for name in LIBRARIES), "lever_loop"]
    subprocess.run(["cmake", "--build", "build", "--target", *targets], cwd=ROOT, check=True, capture_output=True)
    folders = os.pathsep.join(str(ROOT / "build" / folder) for folder in LIBRARIES.values())
    lever, found = str(ROOT / "build/venv/bin/lever"), {}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "rows.json")
        for command, seeds in (("envelope", "8"), ("faults", "4")):
            if names := [row for row in rows if (row in ROWS) == (command == "faults")]:
                arguments = [lever, command, "--only", *names, "--seeds", seeds, "--json", str(file)]
                environment = {**os.environ, "LEVER_CDKF_LIBRARY_DIR": folders}
                subprocess.run(arguments, env=environment, capture_output=True, check=False)
                for row in json.loads(file.read_text(encoding="utf-8"))["rows"]:
                    figures = {k: v for k, v in (row.get("measured") or row["worst"]).items() if v is not None}
                    found[row["name"]] = ", ".join(f"{name} {value:.4g}" for name, value in figures.items())
    return found


def varied(constant: Constant, factor: float) -> dict[str, str]:
    """Return what its rows come to with `factor` times its value."""
    file = FIRMWARE / constant.file
    text = file.read_text(encoding="utf-8")
    label = f"EVIDENCE_{constant.name.upper()}, " if file.suffix == ".def" else f"#define {constant.name} +"
    change = re.compile(rf"({label})(-?[\d.e-]+)f")
    file.write_text(change.sub(lambda match: f"{match[1]}{factor * float(match[2])!r}f", text, 1), encoding="utf-8")
    try:
        return measured(constant.rows)
    finally:
        file.write_text(text, encoding="utf-8")


def vary(names: Iterable[str]) -> None:
    """Print what the rows of constants come to with 0.7, 1 and 1.3 times each."""
    chosen = [each for each in constants() if each.rows and (not names or each.name in names)]
    for each in chosen:
        results = [varied(each, factor) for factor in (0.7, 1.0, 1.3)]
        rows: list[Row] = [
            {"row": row, "times": factor, "comes to": result[row]}
            for row in each.rows
            for factor, result in zip((0.7, 1.0, 1.3), results, strict=True)
        ]
        print_tables({f"{each.name} = {each.value} ({each.file})": rows})
        sys.stdout.flush()


def main() -> int:
    """Print the table, or vary them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vary", nargs="*", metavar="NAME", help="constants with rows (default: all of these)")
    args = parser.parse_args()
    if args.vary is not None:
        vary(args.vary)
        return 0
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
