"""What `--list` prints: every row under its headings, with what each thing is in words."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from lever_sil.aircraft import aircraft
from lever_sil.bounce import conditions as bounce
from lever_sil.campaign import spec
from lever_sil.envelope import conditions as envelope
from lever_sil.envelope import rules
from lever_sil.faults.rows import ROWS
from lever_sil.scenarios import scenario
from lever_sil.study.baselines import BASELINES
from lever_sil.study.compare.cases import cases
from lever_sil.study.figures.catalogue import FIGURES
from lever_sil.study.figures.paper import PAPER
from python.conftest import Run

HEADINGS: dict[str, dict[str, tuple[str, ...]]] = {
    "sim": {"scenarios": ("name", "duration [s]", "title")},
    "compare": {"cases": ("name", "duration [s]", "title"), "estimators": ("name", "title")},
    "compare --envelope": {"conditions": ("name", "title"), "estimators": ("name", "title")},
    "envelope": {"conditions": ("name", "quick", "title", "must"), "rules": ("name", "quick", "title", "must")},
    "bounce": {"conditions": ("name", "quick", "title", "must")},
    "faults": {"faults": ("fault", "title", "must")},
    "campaign": {"specs": ("name", "runs", "title")},
}


Tables = dict[str, list[dict[str, Any]]]
_listed: dict[str, tuple[Tables, str]] = {}


def listed(command: str, lever: Run, folder: Path) -> tuple[Tables, str]:
    """Return the tables of a list as JSON, and what is printed; each is listed once."""
    if command not in _listed:
        status, printed, error = lever(*command.split(), "--list", "--json", folder / "list.json")
        assert (status, error) == (0, "")
        tables = json.loads((folder / "list.json").read_text(encoding="utf-8"))
        tables.pop("provenance", None)
        _listed[command] = tables, printed
    return _listed[command]


@pytest.mark.parametrize("command", HEADINGS)
def test_a_list_has_its_headings(command: str, lever: Run, tmp_path: Path) -> None:
    tables, printed = listed(command, lever, tmp_path)
    assert {title: {tuple(row) for row in rows} for title, rows in tables.items()} == {
        title: {names} for title, names in HEADINGS[command].items()
    }
    for rows in tables.values():
        assert all(row["title"] for row in rows)
        assert all(str(next(iter(row.values()))) in printed for row in rows)


def test_a_list_says_of_each_what_it_is(lever: Run, tmp_path: Path) -> None:
    def rows(command: str, title: str) -> dict[str, dict[str, Any]]:
        return {next(iter(row.values())): row for row in listed(command, lever, tmp_path)[0][title]}

    steady = rows("sim", "scenarios")["steady"]
    assert (steady["duration [s]"], steady["title"]) == (60.0, scenario.load("steady").title)
    assert rows("compare", "cases").keys() == cases().keys()
    assert rows("compare", "cases")["step_up"]["duration [s]"] == 45.0
    assert rows("compare", "estimators").keys() >= {*BASELINES, "dual", "joint", "dual_shipped"}
    assert rows("compare --envelope", "conditions").keys() == envelope.CONDITIONS.keys()
    assert rows("compare --envelope", "estimators").keys() >= {"firmware", "joint_ekf", "joint_ukf_hp"}
    assert rows("faults", "faults").keys() == ROWS.keys()
    assert rows("faults", "faults")["theta_stuck"]["must"] == "THETA within 500 samples, mode run"
    assert rows("campaign", "specs").keys() == set(spec.names())
    assert {name: row["runs"] for name, row in rows("campaign", "specs").items()}["quick"] == 300
    assert rows("envelope", "rules").keys() == rules.RULES.keys()
    of_bounce, of_envelope = rows("bounce", "conditions"), rows("envelope", "conditions")
    assert of_bounce.keys() == bounce.CONDITIONS.keys()
    assert of_envelope.keys() == envelope.CONDITIONS.keys()
    assert of_bounce["limit_none"]["must"] == "reported only"
    assert of_bounce["limit_cancellation"]["must"] == "gearing ÷ critical worst ≥ 4.5"
    assert of_envelope["steady"]["must"] == "f_n rms ≤ 1 %, f_n covered ≥ 90 %, flagged ≤ 2 %"
    assert of_envelope["friction_0.1"]["must"].endswith("k_p covered ≥ 90 %; or flagged ≥ 90 %")
    assert of_envelope["grip_gain_wrong"]["must"] == "k_p ratio ≤ 1"
    assert of_envelope["grip_step"]["must"] == "settled median ≤ 0.9 s, settled worst ≤ 2 s"
    assert (of_envelope["steady"]["quick"], of_envelope["steady_base_only"]["quick"]) == (True, False)


def columns(printed: str) -> list[tuple[str, ...]]:
    """Return the first two cells of each printed line."""
    return [tuple(re.split(r"  +", line.strip())[:2]) for line in printed.splitlines() if line.strip()]


def test_figures_are_listed_with_what_they_show(lever: Run) -> None:
    lines = columns(lever("figures", "--list")[1])
    assert lines.count(("name", "shows")) == 2
    shown = dict(line for line in lines if len(line) == 2)
    assert shown.keys() >= {*FIGURES, *PAPER}
    assert shown["figure_1_bode"] == shown["bode"]


def test_aircraft_are_listed_with_what_they_are(lever: Run) -> None:
    lines = columns(lever("aircraft")[1])
    assert ("name", "what") in lines
    assert {line for line in lines if line[0].endswith("_like")} == {
        (name, aircraft.load(name).title) for name in aircraft.names()
    }
