"""The tables of accuracy as they stand in the READMEs: their form, and the worst runs that they name.

All figures from all seeds: `cmake --workflow --preset accuracy`.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from accuracy import tables
from accuracy.tables import TABLES, Table
from lever_cdkf.host_tools.errors import LeverError
from lever_cdkf.sil import seeds

ALL = TABLES[0]


def written(root: Path, table: Table) -> list[list[str]]:
    return tables.rows(tables.written((root / table.file).read_text(encoding="utf-8"), table.file))


def pair(cell: str) -> tuple[float, float]:
    """The two numbers of "0.8 / 1.2 %"; "60 s / never" has the second infinite."""
    first, second = re.findall(r"\d+(?:\.\d+)?|never", cell)
    return float(first), float(second.replace("never", "inf"))


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.file)
def test_a_table_has_its_form(table: Table, root: Path) -> None:
    header, line, *rows = written(root, table)
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
    header, _, *rows = written(root, ALL)
    row = dict(zip(header, next(row for row in rows if row[0] == f"`{name}`"), strict=True))
    (summary,) = seeds.run([seeds.Task(name, int(row["worst seed"]))], jobs=1)
    errors = {key: entry["rms_percent"] for key, entry in summary["parameters"].items()}
    assert errors["natural_frequency"] == pytest.approx(pair(row["f_n"])[1], abs=0.1 if "." in row["f_n"] else 1.0)
    for key in ("m_p", "c_p", "k_p"):
        assert key not in errors or errors[key] <= pair(row[key])[1] + 0.1
    covered = [entry["coverage_2sigma"] for entry in summary["parameters"].values()]
    assert 100.0 * max(covered) >= pair(row["±2σ covers"])[1] - 1.0


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
    text = f"before\n{tables.BEGIN}{OLD}{tables.END}after\n"
    assert tables.written(text, "x") == OLD
    assert tables.replaced(text, "x", "new\n") == f"before\n{tables.BEGIN}new\n{tables.END}after\n"
    with pytest.raises(LeverError, match="x: has no table between"):
        tables.written("before\n", "x")
