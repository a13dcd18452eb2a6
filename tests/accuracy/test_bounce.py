"""The tables of sil/lever_sil/bounce/README.md: their form, and the worst flights that they name, flown again.

All flights: `cmake --build build --target bounce-tables`.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from accuracy import bounce, tables
from accuracy.bounce import COLUMNS, MISSED, TABLES
from accuracy.tables import Place
from lever_sil.bounce.conditions import CONDITIONS
from lever_sil.bounce.measure import FIGURES


def written(root: Path, place: Place) -> list[list[str]]:
    return tables.rows(tables.written((root / place.file).read_text(encoding="utf-8"), place))


def value(cell: str) -> float:
    return float(cell.removeprefix("≥ ").split()[0].rstrip("°"))


@pytest.mark.parametrize("place", TABLES, ids=lambda place: place.name)
def test_a_table_has_its_form(place: Place, root: Path) -> None:
    """And says of each limit that was missed that it was."""
    header, line, *rows = written(root, place)
    rows_of = [CONDITIONS[row.condition] for row in TABLES[place]]
    flights = {bounce.SEEDS * (1 if each.in_turn else len(each.aircraft)) for each in rows_of}
    assert header == [f"{min(flights)} flights", *COLUMNS]
    assert len(flights) == 1
    assert set(line) == {"---"}
    assert [cells[0] for cells in rows] == [row.says for row in TABLES[place]]
    for row, (_, median, worst, flight, everything, said) in zip(TABLES[place], rows, strict=True):
        limits = [limit for limit in CONDITIONS[row.condition].limits if limit.figure == row.figure]
        values = {"median": value(median), "worst": value(worst), "all": value(everything)}
        assert (MISSED in said) is any(not limit.holds(values[limit.over]) for limit in limits), row
        assert said.removesuffix(MISSED) == ", ".join(map(str, limits))
        assert re.fullmatch(r"\w+_like, pilot \d+", flight)
        if FIGURES[row.figure].more_is_worse:
            assert values["worst"] >= values["median"]
        else:
            assert values["worst"] <= values["median"]


FLOWN = (
    (
        "between accelerometer and pilot",
        "mode at 6 Hz, +0.3 at the seat, accelerometer at the centre of mass: cancellation",
    ),
    ("margin and alarm", "alarm before the vibration doubles"),
    ("largest gearing over critical", "no mitigation, the lever's angle through a low-pass of 1 Hz"),
    ("involuntary and voluntary", "cancellation, `cancellation_corner` 1 Hz, in the loop: gain"),
    ("faults", "z̈ stuck but “valid”: all is zero after"),
)


@pytest.mark.parametrize(("name", "says"), FLOWN, ids=[name for name, _ in FLOWN])
def test_the_worst_flight_is_as_bad_as_the_table_says(name: str, says: str, root: Path) -> None:
    """To the last digit, since a seed gives the same flight on every machine."""
    place = next(each for each in TABLES if each.name == name)
    row = next(row for row in TABLES[place] if row.says == says)
    _, _, worst, flight, *_ = next(cells for cells in written(root, place) if cells[0] == says)
    craft, pilot = flight.split(", pilot ")
    figure = CONDITIONS[row.condition].measure(craft, int(pilot)).figures[row.figure]
    assert f"{figure:.3g}" == f"{value(worst):.3g}"
