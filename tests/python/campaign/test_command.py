"""The command `lever campaign`, but for what tests of kills show."""

from __future__ import annotations

import dataclasses
import json
import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from lever_sil.campaign import chunks, session, spec
from lever_sil.campaign.chunks import Plan
from lever_sil.commands import campaign
from lever_sil.scenarios import scenario
from python.conftest import Refused, Run


@pytest.fixture
def done(undisturbed: dict[str, bytes], tmp_path: Path) -> Path:
    """Return a folder with the whole small campaign."""
    for name, content in undisturbed.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def test_list(lever: Run) -> None:
    status, out, _ = lever("campaign", "--list")
    assert status == 0
    assert "quick" in out
    assert "tracking" in out


def test_a_campaign_that_is_done_is_only_summed_up(lever: Run, small_file: Path, done: Path) -> None:
    status, out, err = lever("campaign", small_file, "-o", done, "--resume", "--json", done / "printed.json")
    assert (status, err) == (0, "")
    assert "48 runs, 0 failed" in out
    summary = json.loads((done / "summary.json").read_text())
    assert summary["minutes_a_run"] == pytest.approx(1.0 / 60.0)
    assert {name: summary[name] for name in ("asked", "runs", "failed")} == {"asked": 48, "runs": 48, "failed": 0}
    rows, _ = json.loads((done / "printed.json").read_text()).values()
    assert [(row["estimator"], row["runs"]) for row in rows] == [("dual", 24), ("rls", 24)]


def test_the_speed_is_kept_when_nothing_is_left_to_do(lever: Run, small: Plan, small_file: Path, done: Path) -> None:
    spec.save(small.spec, done)
    (done / "summary.json").write_text('{"real_time_factor_per_core": 1234.5}')
    assert lever("campaign", small_file, "-o", done, "--resume")[0] == 0
    assert json.loads((done / "summary.json").read_text())["real_time_factor_per_core"] == 1234.5


def test_a_run_alone_is_printed_with_the_command_that_shows_it(lever: Run, small_file: Path, tmp_path: Path) -> None:
    status, out, _ = lever("campaign", small_file, "--run", "14", "--json", tmp_path / "row.json")
    assert status == 0
    rows, _ = json.loads((tmp_path / "row.json").read_text()).values()
    row = {each["column"]: each["value"] for each in rows}
    assert (row["run"], row["seed"], row["estimator"], row["estimator.adaptation"]) == (14, 8, "dual", "robbins_monro")
    command = shlex.split(out.strip().splitlines()[-1])
    assert command[:5] == ["lever", "sim", "steady", "--seed", "8"]
    assert lever(*command[1:-1], tmp_path / "sim")[0] == 0
    quality = json.loads((tmp_path / "sim/summary.json").read_text())["parameters"]["m_p"]
    assert quality["rms_percent"] == pytest.approx(100.0 * row["rms_m_p"], rel=0.1)  # of ten times as many samples


FAILING = """
title = "failing"
scenario = "own.toml"
set = { duration = "1 s", converged_after = "0.4 s" }
seeds = 12
[[vary]]
key = "settings.theta_noise"
values = ["-1 mrad", "1 mrad"]
"""


@pytest.fixture
def failing(tmp_path: Path) -> Path:
    """Twelve runs that fail and twelve that do not, of a scenario beside the spec."""
    folder = tmp_path / "specs"
    folder.mkdir()
    (folder / "own.toml").write_bytes(scenario.SHELF.content("steady"))
    (folder / "failing.toml").write_text(FAILING)
    return folder / "failing.toml"


def test_failed_runs_are_told_some_of_them_and_how_many_more(lever: Run, failing: Path, tmp_path: Path) -> None:
    plan = Plan(spec.load(str(failing)))
    chunks.make(plan, plan.chunk(0), tmp_path)
    status, out, err = lever("campaign", failing, "-o", tmp_path, "--resume")
    assert status == 0
    assert "vary[0]: settings: theta_noise = -0.001 is out of range" in err
    assert "24 runs, 12 failed" in out
    assert out.count("alone: lever campaign") == 5
    assert "failed: 7 more" in out


def test_the_command_of_a_run_finds_the_scenario_of_the_spec(lever: Run, failing: Path, tmp_path: Path) -> None:
    status, out, _ = lever("campaign", failing, "--run", "12")
    assert status == 0
    command = shlex.split(out.strip().splitlines()[-1])
    assert lever(*command[1:-1], tmp_path / "sim")[0] == 0


def test_one_is_a_run_not_runs(lever: Run, tmp_path: Path) -> None:
    one = tmp_path / "one.toml"
    one.write_text('title = "one"\nscenario = "steady"\nset = { duration = "1 s", converged_after = "0.4 s" }\n')
    plan = Plan(spec.load(str(one)))
    chunks.make(plan, plan.chunk(0), tmp_path)
    out = lever("campaign", one, "-o", tmp_path, "--resume")[1]
    assert "\n1 run, 0 failed" in out
    assert out.endswith("summary.json, 1 Parquet file\n")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["quick"], "-o DIR is missing"),
        (["quick", "-o", "out", "--workers", "0"], "--workers: must be at least 1"),
        (["quick", "-o", "out", "--workers", "2", "--scheduler", "tcp://x:1"], "does not go with --scheduler"),
        (["quick", "--run", "300"], "--run 300: the campaign has the runs 0 to 299"),
        (["no.toml", "-o", "out"], "no.toml: no such file"),
        (["what"], "no spec 'what'; there are mismatch, quick, tracking"),
    ],
)
def test_refused(
    arguments: list[str], says: str, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert says in refused("campaign", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_the_json_is_not_written_over_the_spec(refused: Refused, small_file: Path, tmp_path: Path) -> None:
    said = refused("campaign", small_file, "-o", tmp_path / "out", "--json", small_file)
    assert f"cannot write {small_file}: it is an input" in said


@pytest.mark.parametrize("other", ["a run of lever sim", "another campaign"])
def test_a_folder_of_something_else_is_refused_and_left_alone(
    refused: Refused, small: Plan, small_file: Path, tmp_path: Path, other: str
) -> None:
    if other == "another campaign":
        written = small.spec.written.replace(b"seeds = 4", b"seeds = 5")
        spec.save(dataclasses.replace(small.spec, written=written), tmp_path)
    else:
        (tmp_path / "summary.json").write_text('{"schema": 1}')
    ((path, before),) = [(path, path.read_text()) for path in tmp_path.iterdir()]
    assert f"({path.name}): give another folder" in refused("campaign", small_file, "-o", tmp_path)
    assert [(path, path.read_text()) for path in tmp_path.iterdir()] == [(path, before)]


def test_without_resume_what_is_there_is_left_alone(refused: Refused, small_file: Path, done: Path) -> None:
    assert "holds 24 of the 24 chunks of this campaign: add --resume" in refused("campaign", small_file, "-o", done)


def test_a_campaign_is_run_by_as_many_workers_as_asked_for_and_its_speed_is_said(
    lever: Run, small_file: Path, undisturbed: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[tuple[object, int]] = []

    @contextmanager
    def connected(address: str | None, workers: int) -> Iterator[str]:
        begun.append((address, workers))
        yield "client"

    def run(plan: Plan, folder: Path, client: str, _show: object) -> session.Session:
        assert (client, plan.count) == ("client", 24)
        for name, content in undisturbed.items():
            (folder / name).write_bytes(content)
        return session.Session(runs=48, seconds=0.25)

    monkeypatch.setattr(session, "connected", connected)
    monkeypatch.setattr(session, "dashboard", lambda client: f"of {client}")
    monkeypatch.setattr(session, "run", run)
    for options in ((), ("--workers", "3"), ("--scheduler", "tcp://a:1")):
        out = tmp_path / str(len(begun))
        status, printed, error = lever("campaign", small_file, "-o", out, *options)
        assert (status, error) == (0, "")
        words = " ".join(printed.split())
        assert "48 runs in 24 chunks; dashboard: of client" in words
        assert "48 runs, 0 failed, 192 × real time a core." in words
        assert f"Written to {out}: summary.json, 24 Parquet files" in words
        written = json.loads((out / "summary.json").read_text())
        assert written["real_time_factor_per_core"] == 192.0
        assert (out / "spec.json").exists()
    assert begun[:2] == [(None, os.cpu_count()), (None, 3)]
    assert begun[2][0] == "tcp://a:1"


def test_an_interrupted_campaign_says_what_is_kept(
    lever: Run, small_file: Path, undisturbed: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(plan: Plan, folder: Path, _args: object) -> None:
        for name in sorted(undisturbed)[:5]:
            (folder / name).write_bytes(undisturbed[name])
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "_run", interrupted)
    status, _, error = lever("campaign", small_file, "-o", tmp_path)
    assert (status, error) == (130, "lever: interrupted: 10 of 48 runs kept; go on with --resume\n")


def test_a_campaign_of_which_nothing_could_be_made_is_an_error(
    refused: Refused, small: Plan, small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lost = [small.chunk(number) for number in range(small.count)]
    monkeypatch.setattr(campaign, "_run", lambda *_: session.Session(lost=lost))
    assert "every chunk killed the workers that tried it: give the workers more memory" in refused(
        "campaign", small_file, "-o", tmp_path
    )


def test_a_run_alone_that_fails_ends_with_1(lever: Run, failing: Path) -> None:
    status, printed, _ = lever("campaign", failing, "--run", "0")
    assert status == 1
    assert "is out of range" in printed
