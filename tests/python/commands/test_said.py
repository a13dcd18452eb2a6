"""What commands print of options and inputs: rows against their source, proposed commands word by word."""

from __future__ import annotations

import argparse
import json
import re
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from lever_cdkf.cli.progress import Progress
from lever_cdkf.commands import tune
from lever_cdkf.firmware.config import CHOICES, Config, settings_table
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.text.counts import counted, in_percent
from lever_cdkf.text.suggestions import did_you_mean, nearest_names
from lever_cdkf.tune.calibration import Calibrated
from python.conftest import Run


def test_each_row_of_the_settings(lever: Run, tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    lever("settings", "--json", file)
    rows = json.loads(file.read_text())["settings"]
    assert [row["name"] for row in rows] == [*CHOICES, *(each.name for each in settings_table())]
    for row, what in zip(rows, CHOICES, strict=False):
        words = f"one of {', '.join(enum_names(f'lever_{what}').values())}"
        assert row == {
            "name": what, "unit": None, "default": Config().choices[what], "least": None, "greatest": None,
            "meaning": words,
        }  # fmt: skip
    for row, each in zip(rows[len(CHOICES) :], settings_table(), strict=True):
        assert row == {name: getattr(each, name) for name in row}
        assert set(row) == {"name", "unit", "default", "least", "greatest", "meaning"}
    lever("settings", "--set", "theta_noise=2 mrad", "--set", "model=hand", "--json", file)
    values = {row["name"]: row["value"] for row in json.loads(file.read_text())["settings"]}
    assert values == Config(model="hand", settings={"theta_noise": 2e-3}).choices | Config(
        settings={"theta_noise": 2e-3}
    ).settings | {"model": "hand"}


def test_each_row_of_a_proposal(lever: Run, tmp_path: Path) -> None:
    time = np.arange(0.0, 20.0, 0.01)
    columns = {
        "time": time, "Lever angle [deg]": 20.0 + np.sin(9.0 * time), "Lever rate [deg/s]": 9.0 * np.cos(9.0 * time),
        "Vertical acc. [g]": 1.0 + 0.1 * np.sin(14.0 * time), "Oil [degC]": 80.0 + np.cos(time), "Still": 0.0 * time,
    }  # fmt: skip
    log, file = tmp_path / "flight.csv", tmp_path / "rows.json"
    rows = (",".join(f"{value:.6f}" for value in row) for row in zip(*columns.values(), strict=True))
    log.write_text("\n".join([",".join(columns), *rows]))
    _, out, _ = lever("map", log, "--json", file, "--start", "1", "--length", "5", "--toml", tmp_path / "m.toml")
    tables = json.loads(file.read_text())
    assert [row["input"] for row in tables["mapping"]] == ["theta", "theta_dot", "z_ddot"]
    assert [(row["signal"], row["unit"]) for row in tables["mapping"]] == [
        ("Lever angle", "deg"), ("Lever rate", "deg/s"), ("Vertical acc.", "g"),
    ]  # fmt: skip
    (oil,) = tables["other signals"]
    inside = columns["Oil [degC]"][(time >= 1.0) & (time < 6.0)]
    assert (oil["signal"], oil["unit"], oil["rate [Hz]"]) == ("Oil", "degC", 100.0)
    numbers = [oil[name] for name in ("least", "median", "greatest")]
    assert numbers == pytest.approx([inside.min(), np.median(inside), inside.max()], abs=1e-3)
    assert len(oil["plot"]) == 40
    assert "named angle" in tables["mapping"][0]["why"]
    assert "1 other signals never change, and are not shown." in out
    assert f"Written: {tmp_path / 'm.toml'}" in out
    signals = shlex.join([str(log), "--map", "theta=Lever angle", "theta_dot=Lever rate", "z_ddot=Vertical acc."])
    assert f"lever tune {signals} -o my.settings\nlever replay {signals}\n" in out


def test_the_command_that_tunes_another_part_keeps_all_options() -> None:
    args = argparse.Namespace(
        log=["a b.log"], dbc="x.dbc", channel="can1", clock="theta", id_offset=64, id_base=None, map=["theta=a"],
        settings="my.settings", output=Path("out.settings"), page=Path("out.html"), set=["m_p=3", "c_p=40"],
        keep=["theta_noise"],
    )  # fmt: skip
    assert shlex.split(tune._tune(args, 12, 30)) == [
        "lever", "tune", "a b.log", "--dbc", "x.dbc", "--channel", "can1", "--clock", "theta", "--id-offset", "64",
        "--map", "theta=a", "--start", "12", "--length", "30", "--settings", "my.settings", "-o", "out.settings",
        "--page", "out.html", "--set", "m_p=3", "--set", "c_p=40", "--keep", "theta_noise",
    ]  # fmt: skip
    assert shlex.split(tune._replay(args, None)) == [
        "lever", "replay", "a b.log", "--dbc", "x.dbc", "--channel", "can1", "--clock", "theta", "--id-offset", "64",
        "--map", "theta=a", "--settings", "out.settings",
    ]  # fmt: skip
    assert "--map new.toml --settings" in tune._replay(args, Path("new.toml"))


@pytest.mark.parametrize(
    ("keep", "changes", "calm", "words"),
    [
        (["theta_noise", "m_p_walk"], [], 60.0, "try without --keep theta_noise, since noise that is set wrong looks"),
        (["m_p_walk"], [(20.0, 21.0)], 40.6, "try the 39 s from 27 s on, the longest part in which the arm does not"),
        ([], [(20.0, 21.0)], 10.0, "try a part in which the pilot holds still and smooth air shakes the lever"),
        ([], [], 60.0, "try a part in which the pilot holds still and smooth air shakes the lever"),
    ],
)
def test_what_to_try_where_the_calibration_is_not_believed(
    keep: list[str], changes: list[tuple[float, float]], calm: float, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    args = argparse.Namespace(
        log=["a.log"], dbc=None, channel=None, clock=None, id_offset=None, id_base=None, map=[], settings=None,
        output=Path("out.settings"), page=None, set=[], keep=keep, json=None, start=3.0,
    )  # fmt: skip
    health = SimpleNamespace(lost=3, corrupt=0, late=2)
    tuned_on = np.arange(50_000) < 35_000
    likelihood = SimpleNamespace(
        recording=SimpleNamespace(bus="can0", period=1e-3, health=health), tuned_on=tuned_on, judged_by=~tuned_on,
        runs=7, changes=changes, longest_calm=lambda: (24.0, calm),
    )  # fmt: skip
    entry = Calibrated("z_ddot_gain", 1.0, 0.02, 1.03, 0.005, white=False)
    calibration: Any = SimpleNamespace(entries=[entry], text="It stays.")
    assert tune._refuse(args, cast(Any, likelihood), calibration) == 1
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.startswith("lever: tune: no settings are written, since the calibration is not believed: try ")
    row = next(line.split() for line in said.out.splitlines() if line.startswith("z_ddot_gain"))
    assert row[:9] == ["z_ddot_gain", "1", "1", "0.02", "1", "0.02", "1.03", "0.005", "kept:"]
    assert (
        "a.log, can0: tuned on 35 s, judged by the 15 s after it (3 lost, 2 late); 7 runs of the filter. It stays."
    ) in said.out
    next_command = "Next:\nlever tune a.log --start 27 --length 39 -o out.settings --keep m_p_walk\n"
    assert (next_command in said.out) is bool(changes and calm > 20.0)


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_is_told_after_a_moment(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
    with Progress("soak") as progress:
        for at, done in ((101.9, 1), (102.1, 2), (129.9, 3), (130.1, 4), (160.0, 5), (160.2, 6)):
            now[0] = at
            progress.show(done, 10, "a part" if done > 4 else "")
    said = capsys.readouterr().err
    if terminal:
        assert "a part" in said
        assert "100%" not in said
    else:
        assert said == "lever: soak: 4 of 10 after 30 s\nlever: soak: 6 of 10 after 60 s (a part)\n"


def test_numbers_and_names_in_words() -> None:
    assert [counted(number, "run") for number in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]
    assert [in_percent(share) for share in (0.0, 0.9499, 0.95, 0.12345, 1.0)] == [0.0, 94.9, 95.0, 12.3, 100.0]
    known = ("Theta", "theta_dot", "tau_m", "thetas")
    assert nearest_names("THETA", known) == ["Theta", "thetas", "theta_dot"]
    assert nearest_names("theta", known, 1) == ["Theta"]
    assert did_you_mean("thet", known, "no") == "did you mean Theta?"
    assert did_you_mean("xyz", known, "no") == "no"


@pytest.mark.parametrize("command", ["replay", "tune", "record", "monitor", "live", "map", "flash", "qemu", "settings"])
def test_help_begins_with_the_usage_and_has_examples(command: str, lever: Run) -> None:
    status, out, _ = lever(command, "--help")
    assert status == 0
    assert out.startswith(f"usage: lever {command}")
    assert re.search(rf"^examples?:\n(?: .*\n)*  lever {command}", out, re.MULTILINE)


def test_a_minute_of_a_log_is_looked_at_unless_told_otherwise(lever: Run) -> None:
    assert "seconds used (default: 60)" in " ".join(lever("map", "--help")[1].split())
    assert "seconds used (default: all)" in " ".join(lever("replay", "--help")[1].split())
