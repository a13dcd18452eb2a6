"""The tables in sil/lever_sil/bounce/README.md, from the flights of `lever bounce`.

`cmake --build build --target bounce-tables` flies all conditions and compares, bounce-accept flies and writes. The
tables name the flight in which a figure was worst, which test_bounce.py flies again.

Exit status: 0; 1 when a figure differs by more than one in its last digit; 2 when a table cannot be read or written.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if __name__ == "__main__":
    sys.path[0] = str(ROOT / "tests")

from accuracy import tables  # noqa: E402
from accuracy.tables import Place  # noqa: E402
from lever_cdkf.cli.progress import Progress  # noqa: E402
from lever_cdkf.errors import LeverError  # noqa: E402
from lever_cdkf.runtime.files import write_text  # noqa: E402
from lever_sil.acceptance import table  # noqa: E402
from lever_sil.bounce import run_conditions  # noqa: E402
from lever_sil.bounce.conditions import BETWEEN, CONDITIONS, FALSE, SPOILT, STATED  # noqa: E402
from lever_sil.bounce.measure import FIGURES  # noqa: E402

Rows = Mapping[str, Mapping[str, Any]]
"""Those of `lever bounce --json` by the name of their condition."""
SEEDS = 20
FILE = "sil/lever_sil/bounce/README.md"
ACCEPT = "bounce-accept"
MISSED = ": **missed**"


@dataclass(frozen=True)
class Row:
    """A figure of a condition."""

    says: str
    condition: str
    figure: str


_CANCELLED, _GRIP = "involuntary cancelled", "back after a grip"
_GAIN, _PHASE, _LARGEST = "gain changed", "phase changed", "gearing ÷ critical"

TABLES: Mapping[Place, tuple[Row, ...]] = {
    Place(FILE, "between accelerometer and pilot", ACCEPT): tuple(
        Row(f"{title}: {mitigation}", f"between_{name}_{mitigation}", _LARGEST)
        for name, title, _, mitigations, _ in BETWEEN
        for mitigation in mitigations
    ),
    Place(FILE, "alarm and table", ACCEPT): (
        *(
            Row(f"{title}: {what}", f"alarm_{name}", figure)
            for name, title in (*((name, title) for name, title, *_ in STATED), ("sudden", "he relaxes within 0.2 s"))
            for what, figure in (("alarm before the vibration doubles", "alarm lead"), ("flights without", "missed"))
        ),
        *(Row(f"{title}: false alarms in 10 h", f"false_alarms_{name}", "false alarms") for name, title, *_ in FALSE),
    ),
    Place(FILE, "margin and alarm", ACCEPT): (
        Row("alarm before the vibration doubles", "alarm", "alarm lead"),
        Row("alarm before that of the ROVER-like detector", "baselines", "ahead of ROVER"),
        Row("alarm before that of the recursive Fourier transform", "baselines", "ahead of spectrum"),
        Row("the ROVER-like detector before the vibration doubles", "baselines", "ROVER lead"),
        Row("the recursive Fourier transform before that", "baselines", "spectrum lead"),
        Row("false alarms, gain margin 6 dB or more", "false_alarms", "false alarms"),
        Row("flight time of that", "false_alarms", "flight time"),
        Row("false alarms, gain margin 3 dB or more", "false_alarms_3db", "false alarms"),
        Row("flight time of that", "false_alarms_3db", "flight time"),
        Row("gain margin within ±2σ, pilot relaxes", "margin", "margin covered"),
        Row("gain margin within ±2σ, stable flight", "false_alarms", "margin covered"),
        Row("error of the gain margin, within 6 dB of the limit", "margin", "margin rms"),
    ),
    Place(FILE, "largest gearing over critical", ACCEPT): tuple(
        Row(says, f"limit_{name}", _LARGEST)
        for says, name in (
            ("no mitigation", "none"),
            ("no mitigation, the lever's angle through a low-pass of 1 Hz", "none_low_pass"),
            ("lever damping", "damping"),
            ("notch", "notch"),
            ("notch and lever damping", "notch_and_damping"),
            ("cancellation", "cancellation"),
            ("cancellation and lever damping", "cancellation_and_damping"),
            ("cancellation, gusts of 0.1 g", "cancellation_0.1g"),
            ("cancellation and lever damping, gusts of 0.1 g", "cancellation_and_damping_0.1g"),
            ("cancellation, `cancellation_corner` 1 Hz", "cancellation_1hz"),
            ("cancellation and lever damping, `cancellation_corner` 1 Hz", "cancellation_and_damping_1hz"),
            ("cancellation, 5 ms late", "cancellation_5ms"),
            ("cancellation, 10 ms late", "cancellation_10ms"),
            ("cancellation, 10 ms late, and it is told so", "cancellation_10ms_told"),
        )
    ),
    Place(FILE, "involuntary and voluntary", ACCEPT): (
        Row("involuntary part cancelled", "involuntary_cancellation", _CANCELLED),
        Row("back to 80 % after a sudden grip", "involuntary_cancellation", _GRIP),
        Row("involuntary part cancelled, `cancellation_corner` 1 Hz", "involuntary_cancellation_1hz", _CANCELLED),
        *(
            Row(f"{says}{where}: {what}", f"voluntary_{name}{suffix}", figure)
            for where, suffix in (("", ""), (", in the loop", "_in_flight"))
            for says, name in (
                ("cancellation", "cancellation"),
                ("cancellation, `cancellation_corner` 1 Hz", "cancellation_1hz"),
                ("notch", "notch"),
                ("low-pass of 1 Hz", "none_low_pass"),
            )
            for what, figure in (("gain", _GAIN), ("phase", _PHASE))
        ),
        Row("lever damping: gain", "voluntary_damping", _GAIN),
        Row("lever damping: phase", "voluntary_damping", _PHASE),
    ),
    Place(FILE, "faults", ACCEPT): tuple(
        Row(f"{CONDITIONS[name].title.partition(' in mid-')[0]}: {what}", name, figure)
        for name in CONDITIONS
        if name.startswith("fault_")
        for what, figure in (
            ("all is zero after", "to zero"),
            ("the correction adds to the motion for", "adds for"),
            ("jump of the correction", "jump"),
        )
        if figure in CONDITIONS[name].figures
    ),
    Place(FILE, "wrong models", ACCEPT): tuple(
        Row(f"{title}: {what}", f"{kind}_{name}", figure)
        for name, title, _ in SPOILT
        for what, kind, figure in (
            ("largest gearing ÷ critical", "limit", _LARGEST),
            ("lever's angle ÷ that without mitigation", "wrong", "angle ÷ passive"),
            ("flights made unstable", "wrong", "destabilised"),
        )
    ),
}
COLUMNS = ("median", "worst", "worst flight", "all flights", "limit")


def text(place: Place, rows: Rows) -> str:
    """Return a table as Markdown."""
    flights = rows[TABLES[place][0].condition]["runs"]
    return tables.markdown(
        (f"{flights} flights", *COLUMNS), [_cells(row, rows[row.condition]) for row in TABLES[place]]
    )


def _cells(row: Row, measured: Mapping[str, Any]) -> tuple[str, ...]:
    found = next(each for each in measured["figures"] if each["figure"] == row.figure)
    values = {"all": found["all runs"], "median": found["median"], "worst": found["worst"]}
    limits = [limit for limit in CONDITIONS[row.condition].limits if limit.figure == row.figure]
    missed = any(not limit.holds(number(values[limit.over])) for limit in limits)
    unit = {"1": "", "°": "°"}.get(FIGURES[row.figure].unit, f" {FIGURES[row.figure].unit}")
    sought = FIGURES[row.figure].sought_to
    shown = {
        over: f"{'≥ ' if number(value) >= sought else ''}{number(value):.3g}{unit}" for over, value in values.items()
    }
    limit = ", ".join(map(str, limits)) + (MISSED if missed else "")
    return (row.says, shown["median"], shown["worst"], found["worst run"] or "", shown["all"], limit)


def number(value: float | None) -> float:
    """Return what JSON has none of is never reached."""
    return float("inf") if value is None else value


def _flown() -> Iterable[Mapping[str, Any]]:
    conditions = {row.condition for rows in TABLES.values() for row in rows}
    chosen = [condition for name, condition in CONDITIONS.items() if name in conditions]
    with Progress("bounce") as progress:
        return table.rows(run_conditions.run(chosen, SEEDS, progress.show))


def _read(path: Path) -> Iterable[Mapping[str, Any]]:
    rows: Iterable[Mapping[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["rows"]
    return rows


def main() -> int:
    """Compare, or with --accept write the tables."""
    parser = argparse.ArgumentParser(
        prog="python tests/accuracy/bounce.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--accept", action="store_true", help="write the tables into the file")
    parser.add_argument("--rows", metavar="FILE", type=Path, help="flown before: of `lever bounce --json`")
    args = parser.parse_args()
    rows = {row["name"]: row for row in (_flown() if args.rows is None else _read(args.rows))}
    page, wrong = (ROOT / FILE).read_text(encoding="utf-8"), []
    for place in TABLES:
        flown = text(place, rows)
        wrong += [f"{place}: {each}" for each in tables.differences(tables.written(page, place), flown)]
        page = tables.replaced(page, place, flown)
    if args.accept:
        write_text(ROOT / FILE, page)
        print(f"Written to {FILE}")
        return 0
    for line in wrong:
        print(f"bounce: {line}", file=sys.stderr)
    print(f"{len(wrong)} figures differ from {FILE}; `cmake --build build --target {ACCEPT}` writes those flown now")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except LeverError as error:
        print(f"bounce: {error}", file=sys.stderr)
        sys.exit(2)
