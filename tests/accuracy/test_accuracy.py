"""The tables of accuracy as they stand in the READMEs: their form, and the worst runs that they name.

All figures from all seeds: `cmake --workflow --preset accuracy`.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from accuracy import tables, tuning
from accuracy.tables import TABLES, Place, Table
from lever_cdkf.errors import LeverError
from lever_sil.run import seeds


def written(root: Path, place: Place) -> list[list[str]]:
    return tables.rows(tables.written((root / place.file).read_text(encoding="utf-8"), place))


def pair(cell: str) -> tuple[float, float]:
    """Return the two numbers of "0.8 / 1.2 %"; "60 s / never" has the second infinite."""
    first, second = re.findall(r"\d+(?:\.\d+)?|never", cell)
    return float(first), float(second.replace("never", "inf"))


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.place.name)
def test_a_table_has_its_form(table: Table, root: Path) -> None:
    header, line, *rows = written(root, table.place)
    assert header == [f"{tables.SEEDS} seeds", *table.columns]
    assert set(line) == {"---"}
    assert [row[0] for row in rows] == [f"`{name}`" for name in table.scenarios]
    for row in rows:
        for column, cell in zip(header, row, strict=True):
            if " / " in cell and "÷" not in column:
                middle, worst = pair(cell)
                assert middle >= worst if "covers" in column else middle <= worst, (row[0], column, cell)


@pytest.mark.parametrize("name", ["steady", "base_only", "two_dof"])
def test_the_worst_run_is_as_bad_as_the_table_says(name: str, root: Path) -> None:
    """To the last digit, since a seed gives the same run on every machine, and no quantity is worse than its worst."""
    header, _, *rows = written(root, TABLES[0].place)
    row = dict(zip(header, next(row for row in rows if row[0] == f"`{name}`"), strict=True))
    (summary,) = seeds.run([seeds.Task(name, int(row["worst seed"]))], jobs=1)
    errors = {key: entry.rms_percent or 0.0 for key, entry in summary.parameters.items()}
    assert errors["natural_frequency"] == pytest.approx(pair(row["f_n"])[1], abs=0.1 if "." in row["f_n"] else 1.0)
    for key in ("m_p", "c_p", "k_p"):
        assert key not in errors or errors[key] <= pair(row[key])[1] + 0.1
    covered = [entry.coverage_2sigma or 0.0 for entry in summary.parameters.values()]
    assert 100.0 * max(covered) >= pair(row["±2σ covers"])[1] - 1.0


def test_what_tune_finds_is_what_the_table_says(root: Path) -> None:
    """The form, and that one log is within the range of the twenty."""
    header, _, *rows = written(root, tuning.PLACE)
    assert header == [f"{tables.SEEDS} seeds", *tuning.COLUMNS]
    found = {entry.name: entry.best for entry in tuning.search(tuning.Task(changing=False, seed=3))}
    for (name, (truth, scale, _)), row in zip(tuning.TRUTH.items(), rows, strict=True):
        median, least, greatest = map(float, re.findall(r"[\d.]+", row[2])[:3])
        assert row[0] == f"`{name}`"
        assert float(row[1].split()[0]) == pytest.approx(scale * truth)
        assert least <= median <= greatest
        assert name not in found or 0.999 * least <= scale * found[name] <= 1.001 * greatest, name
        assert re.fullmatch(rf"\d+ of {tables.SEEDS}", row[3])


def test_the_calibration_is_found_as_the_table_says(root: Path) -> None:
    """Within 1 %, 0.3 ms and 0.04 N m at worst, ±2σ true of 90 %, and one log is no worse than the worst.

    For friction the aim is 0.03 N m."""
    header, _, *rows = written(root, tuning.CALIBRATION_PLACE)
    assert header == [f"{tables.SEEDS} seeds", *tuning.CALIBRATION_COLUMNS]
    assert [row[0] for row in rows] == [f"`{name}`" for name in tuning.UNKNOWNS for _ in range(2)]
    task = tuning.CalibrationTask("`lever sim`", seed=3)
    found = {f"`{entry.name}`": entry for entry in tuning.calibrated(task)}
    for (name, of, _, error, _, held), limit in zip(rows, (1.0, 1.0, 0.3, 0.3, 0.04, 0.04), strict=True):
        median, worst = pair(error)
        count, total = map(int, held.split(" of "))
        assert median <= worst <= limit, (name, of)
        assert (count >= 0.9 * total, total) == (True, tables.SEEDS), (name, of)
        if of == task.plant:
            scale, truth = tuning.UNKNOWNS[name.strip("`")].scale, task.truth[name.strip("`")]
            assert scale * abs(found[name].best - truth) <= 1.05 * worst, name


OLD = "| 20 seeds | f_n |\n| --- | --- |\n| `steady` | 0.8 / 1.2 % |\n"


@pytest.mark.parametrize(
    ("new", "expected"),
    [
        ("0.8 / 1.3 %", []),  # one in the last digit
        ("0.8 / 1.4 %", ["`steady`, f_n: 0.8 / 1.2 %, now 0.8 / 1.4 %"]),
        ("0.8 / never %", ["`steady`, f_n: 0.8 / 1.2 %, now 0.8 / never %"]),
        ("0.8 / 1.2 % |  ", ["rows or columns differ"]),
    ],
)
def test_what_differs_is_named(new: str, expected: list[str]) -> None:
    assert tables.differences(OLD, OLD.replace("0.8 / 1.2 %", new)) == expected


def test_a_table_replaces_another_between_the_marks_and_nothing_else() -> None:
    first, second = (f"{tables.BEGIN.format(name=name, target='accuracy-accept')}{OLD}{tables.END}" for name in "ab")
    place = Place("x", "b")
    assert tables.written(f"before\n{first}{second}after\n", place) == OLD
    replaced = tables.replaced(f"before\n{first}{second}after\n", place, "new\n")
    assert replaced == f"before\n{first}{second.replace(OLD, 'new' + chr(10))}after\n"
    with pytest.raises(LeverError, match="x: has no table between"):
        tables.written("before\n", place)
