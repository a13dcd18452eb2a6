"""A log with a sudden change of grip: the calibration is found, or nothing is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.signals.mapping import Mapping, Protection, Source, as_toml, read_mapping
from lever_cdkf.tune import recording
from lever_cdkf.tune.calibration import NAMES, calibrate
from lever_cdkf.tune.likelihood import Likelihood
from python.tune.conftest import Simulate

TRUTH = {"z_ddot_gain": 1.0, "z_ddot_delay": 4e-3, "lever_friction": 0.3}


@pytest.fixture(scope="module")
def regripped(simulate: Simulate) -> Path:
    """Return a minute, in the second half of which the arm is half as strong again."""
    return simulate(60.0, regrip=True, delay=TRUTH["z_ddot_delay"], friction=TRUTH["lever_friction"])


def test_a_change_of_grip_is_left_out(regripped: Path) -> None:
    likelihood = Likelihood(recording.read([regripped]), held_out=0.0)
    before = likelihood.tuned_on.sum()
    entries = calibrate(likelihood, {}).entries
    assert any(30.0 < begin < 32.0 for begin, _ in likelihood.changes)
    time = likelihood.recording.time
    assert not likelihood.tuned_on[(time > 30.5) & (time < 33.0)].any()
    assert 0.7 * before < likelihood.tuned_on.sum() < before
    for entry in entries:
        assert entry.verdict == "found", entry
        assert abs(entry.best - TRUTH[entry.name]) < 3.0 * entry.sigma, entry


def test_a_log_that_the_model_does_not_explain_changes_nothing(
    simulate: Simulate, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, out, figures = simulate(30.0, tremor=0.3), tmp_path / "my.settings", tmp_path / "figures.json"
    assert main(["tune", str(log), "-o", str(out), "--json", str(figures)]) == 1
    assert not out.exists()
    rows = json.loads(figures.read_text(encoding="utf-8"))["calibration"]
    assert [row["name"] for row in rows] == list(NAMES)
    said = capsys.readouterr().err
    assert "no settings are written, since the calibration is not believed: try a part in which the pilot" in said


def test_a_mapping_keeps_all_that_it_says(tmp_path: Path) -> None:
    mapping = Mapping(
        {"theta": Source("LEVER.Angle", unit="deg"), "z_ddot": Source("IMU.Acc Z", delay=4e-3, sign=-1)},
        {"IMU": Protection(1, 0x1A2, "Counter"), "LEVER": Protection(counter="Count")},
        "t",
    )
    file = tmp_path / "my.mapping.toml"
    file.write_text(as_toml(mapping), encoding="utf-8")
    assert read_mapping([str(file)]) == mapping
