"""The tables of accuracy in README.md and sil/README.md, from runs of many seeds."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[0] = str(ROOT / "tests")

from accuracy import tables  # noqa: E402
from lever_cdkf.host_tools.errors import LeverError  # noqa: E402
from lever_cdkf.host_tools.files import write_text  # noqa: E402
from lever_cdkf.host_tools.progress import Progress  # noqa: E402
from lever_cdkf.sil import seeds  # noqa: E402

_DESCRIPTION = f"""\
Runs each scenario of the tables of accuracy in README.md and sil/README.md with seeds 1 to {tables.SEEDS}, and compares
median, worst and coverage with what the files say. It takes three minutes on two cores.

Exit status: 0; 1 when a figure differs by more than one in its last digit; 2 when a table cannot be read or written.
"""


def main() -> int:
    """Compares, or with --accept writes the tables."""
    parser = argparse.ArgumentParser(
        prog="python tests/accuracy", description=_DESCRIPTION, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--accept", action="store_true", help="write the tables into the files")
    args = parser.parse_args()
    for table in tables.TABLES:
        tables.written(_text(table.file), table.file)  # before runs that could then not be compared
    made = _made()
    if args.accept:
        for file, text in made.items():
            write_text(ROOT / file, tables.replaced(_text(file), file, text))
            print(f"Written to {file}:\n{text}")
        return 0
    wrong = [
        f"{file}: {difference}"
        for file, table in made.items()
        for difference in tables.differences(tables.written(_text(file), file), table)
    ]
    for line in wrong:
        print(f"accuracy: {line}", file=sys.stderr)
    if wrong:
        print(f"{len(wrong)} figures differ; `cmake --build build --target accuracy-accept` writes those made now")
        return 1
    print(f"All figures of {', '.join(made)} are those of the runs.")
    return 0


def _text(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


def _made() -> dict[str, str]:
    """The tables as they have to be, by file."""
    names = list(dict.fromkeys(name for table in tables.TABLES for name in table.scenarios))
    tasks = [seeds.Task(name, seed) for name in names for seed in range(1, tables.SEEDS + 1)]
    with Progress("accuracy") as progress:
        done = seeds.run(tasks, os.cpu_count() or 1, progress.show)
    summaries = {name: done[at * tables.SEEDS : (at + 1) * tables.SEEDS] for at, name in enumerate(names)}
    return {table.file: table.text(summaries) for table in tables.TABLES}


if __name__ == "__main__":
    try:
        sys.exit(main())
    except LeverError as error:
        print(f"accuracy: {error}", file=sys.stderr)
        sys.exit(2)
