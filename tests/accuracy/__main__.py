"""The tables of accuracy in README.md and sil/README.md, from runs of many seeds."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[0] = str(ROOT / "tests")

from accuracy import tables, tuning  # noqa: E402
from accuracy.tables import Place  # noqa: E402
from lever_cdkf.cli.progress import Progress  # noqa: E402
from lever_cdkf.errors import LeverError  # noqa: E402
from lever_cdkf.runtime.files import write_text  # noqa: E402
from lever_sil.run import seeds  # noqa: E402

_DESCRIPTION = f"""\
Runs each scenario of the tables of accuracy in README.md and sil/README.md with seeds 1 to {tables.SEEDS}, and compares
median, worst and coverage with what the files say. Likewise what `lever tune` finds. It takes six minutes
on two cores.

Exit status: 0; 1 when a figure differs by more than one in its last digit; 2 when a table cannot be read or written.
"""


def main() -> int:
    """Compare, or with --accept write the tables."""
    parser = argparse.ArgumentParser(
        prog="python tests/accuracy", description=_DESCRIPTION, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--accept", action="store_true", help="write the tables into the files")
    args = parser.parse_args()
    for place in (*(table.place for table in tables.TABLES), tuning.PLACE, tuning.CALIBRATION_PLACE):
        tables.written(_text(place), place)  # before runs that could then not be compared
    texts = _texts()
    if args.accept:
        for place, table in texts.items():
            write_text(ROOT / place.file, tables.replaced(_text(place), place, table))
            print(f"Written to {place}:\n{table}")
        return 0
    wrong = [
        f"{place}: {difference}"
        for place, table in texts.items()
        for difference in tables.differences(tables.written(_text(place), place), table)
    ]
    for line in wrong:
        print(f"accuracy: {line}", file=sys.stderr)
    if wrong:
        print(f"{len(wrong)} figures differ; `cmake --build build --target accuracy-accept` writes those made now")
        return 1
    print("All figures are those of the runs.")
    return 0


def _text(place: Place) -> str:
    return (ROOT / place.file).read_text(encoding="utf-8")


def _texts() -> dict[Place, str]:
    """Return the tables as they have to be."""
    jobs = os.cpu_count() or 1
    names = list(dict.fromkeys(name for table in tables.TABLES for name in table.scenarios))
    tasks = [seeds.Task(name, seed) for name in names for seed in range(1, tables.SEEDS + 1)]
    with Progress("accuracy") as progress:
        done = seeds.run(tasks, jobs, progress.show)
    with Progress("accuracy of lever tune") as progress:
        found = seeds.in_processes(tuning.search, tuning.tasks(tables.SEEDS), jobs, progress.show)
    with Progress("accuracy of the calibration") as progress:
        logs = tuning.calibration_tasks(tables.SEEDS)
        calibrated = seeds.in_processes(tuning.calibrated, logs, jobs, progress.show)
    summaries = {name: done[at * tables.SEEDS : (at + 1) * tables.SEEDS] for at, name in enumerate(names)}
    texts = {table.place: table.text(summaries) for table in tables.TABLES}
    texts[tuning.PLACE] = tuning.text(found)
    texts[tuning.CALIBRATION_PLACE] = tuning.calibration_text(logs, calibrated)
    return texts


if __name__ == "__main__":
    try:
        sys.exit(main())
    except LeverError as error:
        print(f"accuracy: {error}", file=sys.stderr)
        sys.exit(2)
