"""The tables of sil/lever_sil/study/PAPER.md: their form, and some rows of them from the same 20 runs.

All rows: `cmake --build build --target paper-tables`.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from accuracy import paper, protocols, tables
from accuracy.paper import MODELS, SEEDS, TABLES
from accuracy.tables import Place
from lever_sil.study import no_accelerometer
from lever_sil.study.compare import paper as experiment
from lever_sil.study.compare import run_cases
from lever_sil.study.compare.cases import Plan, Protocol, cases
from lever_sil.study.compare.entrants import entrants, tuning_name, wrongly_tuned

PLACES = {place.name: place for place in TABLES}


def written(root: Path, place: Place) -> list[list[str]]:
    return tables.rows(tables.written((root / place.file).read_text(encoding="utf-8"), place))


@pytest.mark.parametrize("place", TABLES, ids=lambda place: place.name)
def test_a_median_is_no_worse_than_the_worst(place: Place, root: Path) -> None:
    header, line, *rows = written(root, place)
    assert set(line) == {"---"}
    assert rows
    for row in rows:
        for column, cell in zip(header, row, strict=True):
            if " / " in cell:
                middle, worst = (float(part.replace("never", "inf")) for part in cell.rstrip(" %s").split(" / "))
                more_is_better = "covers" in column or "VAF" in column
                assert middle >= worst if more_is_better else middle <= worst, (row, column)


def test_every_estimator_and_every_tuning_has_its_row(root: Path) -> None:
    for model in MODELS:
        names = entrants(cases()[f"paper_{model}_jump_fine_quiet"])
        _, _, *rows = written(root, PLACES[f"experiment, {model}"])
        expected = {(truth, name) for truth in ("constant", "drift", "jump") for name in names}
        assert {(row[0], row[1]) for row in rows} == expected
    _, _, *rows = written(root, PLACES["wrong tuning"])
    assert len(rows) == len(list(wrongly_tuned())) == 1 + 8 + 24
    assert len({row[0] for row in rows}) == len(rows)
    _, _, *rows = written(root, PLACES["no accelerometer"])
    assert {row[0] for row in rows} == set(no_accelerometer.BASES)


def test_the_protocols_have_every_estimator(root: Path) -> None:
    _, _, *rows = written(root, PLACES["remnant"])
    expected = {
        (case.truth, f"{case.process_noise:g}", name)
        for case in map(cases().__getitem__, protocols.names())
        if isinstance(case, Protocol)
        for name in entrants(case)
    }
    assert {(row[0], row[1], row[2]) for row in rows} == expected
    _, _, *rows = written(root, PLACES["square wave"])
    assert [row[0] for row in rows] == [*entrants(cases()[protocols.SQUARE_WAVE]), "the true parameters"]
    for row in rows[:-1]:
        bias, scatter, total = map(float, row[2:5])
        assert math.hypot(bias, scatter) == pytest.approx(total, rel=0.1)


def test_what_the_page_says_of_the_protocols_is_in_their_tables(root: Path) -> None:
    _, _, *rows = written(root, PLACES["remnant"])
    times = {(row[1], row[2]): row[5].split(" / ") for row in rows if row[0] == "jump"}
    stays = {row[2]: float(row[3].split(" / ")[0]) for row in rows if row[0] == "constant" and row[1] == "0.05"}
    assert min(stays, key=stays.__getitem__).startswith("rls")
    for remnant in ("0.02", "0.05"):
        assert all(
            float(times[remnant, "dual_shipped"][0]) < float(times[remnant, name][0].replace("never", "inf"))
            for _, name in times
            if name != "dual_shipped"
        )
    assert times["0.05", "rls"][0] == "10"
    assert times["0.2", "dual_shipped"][1] == "never"


def test_a_row_of_the_experiment_is_that_of_the_runs(root: Path) -> None:
    names = [name for name in experiment.names() if name.startswith("paper_linear_physical_constant")]
    results = run_cases.run(run_cases.tasks(names, ["rls"], Plan(SEEDS)), jobs=1)
    (rows,) = experiment.tables(results).values()
    header, _, *table = written(root, PLACES["experiment, linear_physical"])
    there = next(row for row in table if row[:2] == ["constant", "rls"])
    assert tables.differences(paper.text([dict(zip(header, there, strict=True))]), paper.text(rows)) == []


def test_a_row_of_wrong_tuning_is_that_of_the_runs(root: Path) -> None:
    """The exception: the median is near that of the right tuning, the worst run is not."""
    header, _, *table = written(root, PLACES["wrong tuning"])
    row = dict(zip(header, next(row for row in table if row[0] == "r × 0.1, q × 10"), strict=True))
    case, name = cases()["wrong_tuning_fixed"], tuning_name({"r": "0.1", "q": "10"})
    results = run_cases.run([run_cases.Task(case.name, name, Plan(SEEDS))], jobs=1)
    rms = 100.0 * experiment.of_runs(results.outcomes[case.name, name], case, results.plan).rms
    assert max(rms) == pytest.approx(float(row["fixed: rms [%]"].split(" / ")[1]), abs=1.0)
    right = float(dict(zip(header, table[0], strict=True))["fixed: rms [%]"].split(" / ")[1])
    assert max(rms) > 2.0 * right


def test_what_the_page_says_of_single_figures_is_in_its_tables(root: Path) -> None:
    _, _, *table = written(root, PLACES["experiment, lever"])
    rms = {row[1]: row[2].split(" / ")[0] for row in table if row[0] == "constant"}
    jump = {row[1]: row[5].split(" / ")[0] for row in table if row[0] == "jump"}
    page = (root / paper.FILE).read_text(encoding="utf-8")
    assert f"rms {rms['dual_fixed']} against {rms['joint_fixed']} %" in page
    assert f"rms {rms['dual_ekf']} against {rms['dual_fixed']} %" in page
    assert f"rms {rms['dual_annealing']}, {rms['dual_robbins_monro']}, {rms['dual_fixed']} %" in page
    assert f"rms {rms['algorithm1']} %" in page
    assert f"f_n to 5 % after {jump['dual_fixed']} s" in page
    assert re.search(r"all but `dual_shipped` are told", page, re.IGNORECASE)
