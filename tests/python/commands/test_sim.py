"""`lever sim` and `lever demo` as a user calls them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from lever_sil.scenarios import scenario
from python.conftest import Refused, Run

SHORT = ("--set", "duration=1 s", "--set", "converged_after=0.2 s", "--set", "limits={}")


def test_list_names_every_scenario(lever: Run, tmp_path: Path) -> None:
    status, out, _ = lever("sim", "--list", "--json", str(tmp_path / "list.json"))
    assert status == 0
    rows = json.loads((tmp_path / "list.json").read_text())["scenarios"]
    assert [row["name"] for row in rows] == scenario.names()
    assert all(name in out for name in scenario.names())


def test_a_broken_scenario_does_not_hide_the_others(
    lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text("title = \n")
    monkeypatch.setattr(scenario, "names", lambda: [str(broken), "steady"])
    status, out, err = lever("sim", "--list")
    assert status == 0
    assert "steady" in out
    assert err.startswith(f"lever: warning: left out: {broken}: ")


def test_sim_writes_its_files_and_prints_its_tables(lever: Run, tmp_path: Path) -> None:
    out_dir, tables = tmp_path / "out" / "deep", tmp_path / "tables.json"
    status, out, err = lever("sim", "steady", *SHORT, "--out", str(out_dir), "--json", str(tables))
    assert (status, err) == (0, "")
    assert sorted(path.name for path in out_dir.iterdir()) == ["bus.log", "report.html", "summary.json", "trace.csv"]
    summary = json.loads((out_dir / "summary.json").read_text())
    assert summary["samples"] == 1000
    assert summary["passed"]
    assert summary["verdict"] in out
    assert "below 10 % after [s]" in out
    assert len((out_dir / "trace.csv").read_text().splitlines()) == 1001
    assert "<html" in (out_dir / "report.html").read_text()[:200]
    title, run, _ = json.loads(tables.read_text()).values()
    assert [row["quantity"] for row in title] == list(summary["parameters"])
    for row in title:
        entry = summary["parameters"][row["quantity"]]
        assert row["rms error [%]"] == pytest.approx(entry["rms_percent"])
        assert row["bias [%]"] == pytest.approx(entry["bias_percent"])
        assert row["truth within 2 sigma [1]"] == pytest.approx(entry["coverage_2sigma"])
    assert run[0]["samples"] == 1000


def test_without_out_no_file_is_written(lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert lever("sim", "steady", *SHORT)[0] == 0
    assert list(tmp_path.iterdir()) == []


def test_missed_limits_are_an_exit_status_and_a_line(lever: Run) -> None:
    status, _, err = lever("sim", "steady", *SHORT, "--set", "limits.m_p=0.001 %")
    assert status == 1
    assert err.startswith("lever: steady: rms error of m_p")
    assert err.count("\n") == 1


def test_a_file_of_ones_own_can_be_run_and_seeded(lever: Run, tmp_path: Path) -> None:
    text = (Path(scenario.__file__).parent / "steady.toml").read_text()
    (tmp_path / "mine.toml").write_text(text)
    outs = []
    for seed in ("3", "4"):
        assert lever("sim", str(tmp_path / "mine.toml"), *SHORT, "--seed", seed, "--out", str(tmp_path / seed))[0] == 0
        assert json.loads((tmp_path / seed / "summary.json").read_text())["scenario"]["seed"] == int(seed)
        outs.append((tmp_path / seed / "bus.log").read_bytes())
    assert outs[0] != outs[1]


def test_settings_prints_a_settings_file_for_the_firmware(lever: Run, tmp_path: Path) -> None:
    from lever_cdkf.firmware.settings_file import make_config, read_assignments

    status, out, _ = lever("sim", "high_noise", "--settings")
    assert status == 0
    (tmp_path / "x.settings").write_text(out)
    config = make_config(read_assignments(tmp_path / "x.settings"))
    assert config.settings == scenario.load("high_noise").config.settings


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sim", "nope"), "no scenario 'nope'; there are base_dither"),
        (("sim",), "one of the arguments"),
        (("sim", "steady", "--set", "pilot.m_p=3"), "lever: error: --set pilot.m_p=3: pilot.m_p: 3 is not"),
        (("sim", "steady", "--seed", "-1"), "argument --seed: -1 is not from 0 to "),
        (("sim", "steady", "--interface", "slcan"), "--interface slcan needs --channel"),
        (
            ("sim", "steady", "--interface", "slcan", "--channel", "/dev/nothing"),
            "cannot open slcan channel /dev/nothing",
        ),
        (("sim", "steady", "--bus-option", "settings"), "--bus-option settings: must be KEY=VALUE"),
        (("sim", "steady", "--bus-option", "speed=1"), "interface 'lever' has no option speed"),
        (("sim", "steady", "--interface", "socketcan", "--channel", "nocan7"), "cannot open socketcan channel nocan7"),
        (
            ("sim", "steady", *SHORT, "--out", __file__),
            f"cannot make the folder {__file__}: there is a file of that name",
        ),
        (("sim", "steady", *SHORT, "--out", "/dev/null/x"), "cannot make the folder /dev/null/x"),
    ],
)
def test_what_is_wrong_is_one_line_and_status_2(refused: Refused, arguments: tuple[str, ...], message: str) -> None:
    assert message in refused(*arguments)


def test_the_demo_is_its_scenario(lever: Run, tmp_path: Path) -> None:
    status, out, err = lever("demo", "--out", str(tmp_path / "demo"))
    assert status == 0, err + out
    summary = json.loads((tmp_path / "demo" / "summary.json").read_text())
    assert summary["scenario"]["name"] == "demo"
    assert summary["samples"] == 60_000


@pytest.mark.parametrize("more", [(), ("--seeds", "2")])
def test_the_json_is_not_written_over_an_input(more: tuple[str, ...], tmp_path: Path, refused: Refused) -> None:
    own, settings = tmp_path / "own.toml", tmp_path / "my.settings"
    own.write_bytes(scenario.SHELF.content("steady"))
    settings.write_text("m_p = 3 kg\n")
    for path in (own, settings):
        before = path.read_bytes()
        said = refused("sim", own, "--settings", settings, *SHORT, *more, "--json", path)
        assert f"cannot write {path}: it is an input" in said
        assert path.read_bytes() == before
