"""`lever bounce`: a reduced part of the table in every test run."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_sil.acceptance.result import Limit
from lever_sil.bounce import bounce_page, conditions, measure, run_conditions
from lever_sil.bounce.conditions import CONDITIONS, Condition
from lever_sil.bounce.flights import FIVE, Plan
from lever_sil.bounce.measure import FIGURES, Excerpt, Measured
from python.conftest import Refused
from python.report.reading import Reader, figures, unpack


def test_the_reduced_table_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    files = ["--out", str(tmp_path), "--json", str(tmp_path / "rows.json")]
    status = main(["bounce", "--quick", "--seeds", "1", *files])
    printed = capsys.readouterr().out
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]}
    written = (tmp_path / "bounce.html").read_text(encoding="utf-8")
    assert set(rows) == {name for name, row in CONDITIONS.items() if row.quick}
    assert all(name in printed and f'id="{name}"' in written for name in rows)
    assert {name: row["measured"] for name, row in rows.items() if not row["ok"]} == {}
    assert status == 0


def test_every_figure_is_one_that_is_known() -> None:
    for row in CONDITIONS.values():
        assert row.figures
        assert set(row.figures) <= set(FIGURES)


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_flight_of_a_condition_can_be_flown(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is a scenario that is valid, also where only the whole table flies it."""

    def fly(plan: Plan) -> NoReturn:
        assert plan.scenario.aircraft is not None
        raise InterruptedError

    monkeypatch.setattr(measure, "fly", fly)
    with pytest.raises(InterruptedError):
        CONDITIONS[name].measure(CONDITIONS[name].aircraft[-1], 1)


def test_results_are_of_all_aircraft_and_pilots(monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(craft: str, seed: int) -> Measured:
        return Measured({"alarm lead": float(len(craft) + 10 * seed)})

    row = Condition("made_up", "title", measured, (Limit("alarm lead", least=10.0, over="worst"),))
    monkeypatch.setattr(run_conditions, "CONDITIONS", {"made_up": row})
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    (result,) = run_conditions.run([row], 2, lambda *_: None)
    assert sorted(result.values["alarm lead"].tolist()) == [9.0, 9.0, 10.0, 19.0, 19.0, 20.0]
    assert not result.ok
    assert result.worst_run("alarm lead") == "uh60_like, pilot 0"
    assert "MISSED" in bounce_page.build([result], 2)
    assert np.isclose(result.of(row.limits[0]), 9.0)


def test_the_page_shows_a_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    """The margin with its band, up to 15 dB, the lever, the cabin, and lines when what came."""
    time = np.linspace(0.0, 10.0, 101)
    shown = Excerpt(time, time - 3.0, time + 6.0, np.full(101, 2.0), 0.1 * time, 0.2 * time, 0.3 * time, {"alarm": 4.0})
    row = Condition("made_up", "title", lambda *_: Measured({"alarm lead": 1.0}, shown), aircraft=FIVE[:1])
    monkeypatch.setattr(run_conditions, "CONDITIONS", {"made_up": row})
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    (result,) = run_conditions.run([replace(row, also=("alarm lead",))], 1, lambda *_: None)
    (chart,) = figures(Reader(bounce_page.build([result], 1))).values()
    low, high, truth, estimate, theta, correction, cabin = (unpack(trace["y"]) for trace in chart["data"])
    for drawn, values in (
        (estimate, np.minimum(time + 6.0, 15.0)),
        (low, np.minimum(time + 6.0, 15.0) - 4.0),
        (high, np.minimum(time + 10.0, 15.0)),
        (truth, time - 3.0),
        (theta, 0.1 * time),
        (cabin, 0.2 * time),
        (correction, 0.3 * time),
    ):
        np.testing.assert_allclose(drawn, values, rtol=1e-4, atol=1e-3)
    assert [shape["x0"] for shape in chart["layout"]["shapes"] if shape["x0"] == shape["x1"]] == [4.0]


def test_pilots_may_fly_the_aircraft_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    limit = Limit("alarm lead", least=0.0, over="worst")
    row = Condition("made_up", "title", lambda *_: Measured({"alarm lead": 1.0}), (limit,), aircraft=FIVE, in_turn=True)
    monkeypatch.setattr(run_conditions, "CONDITIONS", {"made_up": row})
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    (result,) = run_conditions.run([row], 7, lambda *_: None)
    assert result.runs == [f"{craft}, pilot {seed}" for seed, craft in enumerate((*FIVE, *FIVE[:2]))]


def test_the_list_names_every_condition(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bounce", "--list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in conditions.CONDITIONS)


def test_bad_input_is_one_line(refused: Refused) -> None:
    assert "did you mean alarm?" in refused("bounce", "--only", "alrm")
