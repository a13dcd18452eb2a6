"""The tables in sil/lever_sil/study/PAPER.md, from runs of 20 and 100 seeds.

`cmake --build build --target paper-tables` makes all of them and compares, paper-accept makes and writes, in
half an hour. --only NAME takes some.

Exit status: 0; 1 when a figure differs by more than one in its last digit; 2 when a table cannot be read or written.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if __name__ == "__main__":
    sys.path[0] = str(ROOT / "tests")

from accuracy import protocols, tables  # noqa: E402
from accuracy.tables import Place  # noqa: E402
from lever_cdkf.cli.progress import Progress  # noqa: E402
from lever_cdkf.cli.tables import Cell, Row  # noqa: E402
from lever_cdkf.errors import LeverError  # noqa: E402
from lever_cdkf.runtime.files import write_text  # noqa: E402
from lever_sil.run import seeds  # noqa: E402
from lever_sil.study import no_accelerometer  # noqa: E402
from lever_sil.study.compare import paper, run_cases  # noqa: E402
from lever_sil.study.compare.cases import Plan, cases  # noqa: E402
from lever_sil.study.compare.entrants import tuning_name, wrongly_tuned  # noqa: E402

SEEDS = paper.SEEDS
FILE = "sil/lever_sil/study/PAPER.md"
ACCEPT = "paper-accept"
MODELS = ("linear_physical", "linear_black_box", "lever")
TUNING = ("wrong_tuning_fixed", "wrong_tuning_trim")


def _ran(names: Sequence[str], count: int = SEEDS) -> run_cases.Results:
    todo = run_cases.tasks(names, None, Plan(count))
    with Progress("paper") as progress:
        return run_cases.run(todo, os.cpu_count() or 1, progress.show)


@cache
def _experiment() -> Mapping[str, Sequence[Row]]:
    return paper.tables(_ran(paper.names()))


def tuning(results: run_cases.Results) -> list[Row]:
    """Return a row for each wrong tuning of the cases wrong_tuning_*, the right one first."""
    rows: list[Row] = []
    for wrong in wrongly_tuned():
        row: dict[str, Cell] = {"wrong": ", ".join(f"{name} × {factor}" for name, factor in wrong.items()) or "nothing"}
        for name in TUNING:
            preload = cases()[name].preload
            figures = paper.of_runs(results.outcomes[name, tuning_name(wrong)], cases()[name], results.plan)
            row |= {
                f"{preload}: rms [%]": paper.pair(100.0 * figures.rms),
                f"{preload}: ±2σ covers [%]": paper.pair(-100.0 * figures.covered),
            }
        rows.append(row)
    return rows


RELAXED = tables.Table(
    Place(FILE, "relaxed hand", ACCEPT), ("relaxed_hand",), tables.TABLES[0].columns, tables.TABLES[0].cells
)


def relaxed() -> list[Row]:
    """Return the row of the relaxed hand, as in the README's table of scenarios."""
    (name,) = RELAXED.scenarios
    tasks = [seeds.Task(name, seed) for seed in range(1, SEEDS + 1)]
    with Progress("paper") as progress:
        done = seeds.run(tasks, os.cpu_count() or 1, progress.show)
    header, _, row = tables.rows(RELAXED.text({name: done}))
    return [dict(zip(header, row, strict=True))]


TABLES: Mapping[Place, Callable[[], Sequence[Row]]] = {
    **{
        Place(FILE, f"experiment, {model}", ACCEPT): partial(lambda model: _experiment()[f"{model}, 20 seeds"], model)
        for model in MODELS
    },
    Place(FILE, "wrong tuning", ACCEPT): lambda: tuning(_ran(TUNING)),
    Place(FILE, "no accelerometer", ACCEPT): no_accelerometer.rows,
    Place(FILE, "remnant", ACCEPT): lambda: protocols.remnants(_ran(protocols.names(), protocols.SEEDS)),
    Place(FILE, "square wave", ACCEPT): lambda: protocols.square_wave(_ran([protocols.SQUARE_WAVE], protocols.SEEDS)),
    RELAXED.place: relaxed,
}


def text(rows: Sequence[Row]) -> str:
    """Return a table as Markdown."""
    cells = [tuple("–" if row.get(name) is None else str(row[name]) for name in rows[0]) for row in rows]
    return tables.markdown(tuple(rows[0]), cells)


def main() -> int:
    """Compare, or with --accept write the tables."""
    parser = argparse.ArgumentParser(
        prog="python tests/accuracy/paper.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--accept", action="store_true", help="write the tables into the file")
    parser.add_argument("--only", metavar="NAME", nargs="+", help=f"of {', '.join(place.name for place in TABLES)}")
    args = parser.parse_args()
    wrong: list[str] = []
    for place, make in TABLES.items():
        if args.only is None or place.name in args.only:
            page = (ROOT / FILE).read_text(encoding="utf-8")
            there = tables.written(page, place)  # before runs that could then not be compared
            made = text(make())
            wrong += [f"{place}: {each}" for each in tables.differences(there, made)]
            if args.accept:
                write_text(ROOT / FILE, tables.replaced(page, place, made))
    if args.accept:
        print(f"Written to {FILE}")
        return 0
    for line in wrong:
        print(f"paper: {line}", file=sys.stderr)
    print(f"{len(wrong)} figures differ from {FILE}; `cmake --build build --target {ACCEPT}` writes those made now")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except LeverError as error:
        print(f"paper: {error}", file=sys.stderr)
        sys.exit(2)
