"""What commands print of what they have done: titles, counts, units and files, against what was computed."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lever_sil.acceptance.result import Limit
from lever_sil.aircraft import aircraft
from lever_sil.bounce import conditions as bounce
from lever_sil.bounce import run_conditions as bounce_run
from lever_sil.bounce.measure import Measured
from lever_sil.commands import sim
from lever_sil.envelope import conditions as envelope
from lever_sil.envelope import run_conditions as envelope_run
from lever_sil.envelope.condition import Condition
from lever_sil.faults import matrix
from lever_sil.faults.rows import ROWS
from lever_sil.run import runner
from lever_sil.scenarios import scenario
from lever_sil.study.baselines import BASELINES
from lever_sil.study.compare import cases, entrants, run_cases
from lever_sil.study.compare_envelope import run_estimators
from python.conftest import Refused, Run


@pytest.fixture(autouse=True)
def _nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget whose estimator took part."""
    monkeypatch.setattr(entrants, "_CANDIDATES", {})


SHORT = ("--set", "duration=1 s", "--set", "converged_after=0.2 s", "--set", "limits={}")


@pytest.mark.parametrize(
    ("command", "of", "seeds", "title"),
    [
        ("envelope", envelope_run, 1, "1 random pilot a condition"),
        ("envelope", envelope_run, 3, "3 random pilots a condition"),
        ("bounce", bounce_run, 1, "1 random pilot an aircraft a condition"),
        ("bounce", bounce_run, 3, "3 random pilots an aircraft a condition"),
    ],
)
def test_a_table_of_conditions_says_how_many_pilots_flew(
    command: str, of: Any, seeds: int, title: str, lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And whether all limits hold, which not every condition has."""
    flown: list[int] = []
    conditions = {"envelope": envelope, "bounce": bounce}[command]
    rows: list[Any] = [Condition("kept", "", limits=(Limit("flagged", most=1.0),)), Condition("told", "")]
    if command == "bounce":
        rows = [
            bounce.Condition("kept", "", lambda *_: Measured({}), (Limit("missed", most=1.0),)),
            bounce.Condition("told", "", lambda *_: Measured({}), also=("missed",)),
        ]

    def run(chosen: list[Any], *arguments: Any) -> list[Any]:
        flown.append(arguments[-2])
        result = {"envelope": envelope_run.EnvelopeResult, "bounce": bounce_run.BounceResult}[command]
        return [result(row, dict.fromkeys(row.figures, np.zeros(seeds))) for row in chosen]

    monkeypatch.setattr(conditions, "CONDITIONS", {row.name: row for row in rows})
    monkeypatch.setattr(of, "run", run)
    status, printed, _ = lever(command, "--seeds", str(seeds))
    assert (status, flown) == (0, [seeds])
    assert title in printed.splitlines()
    assert "1 of 1 conditions hold." in printed
    assert "None of these has limits." in lever(command, "--only", "told", "--seeds", str(seeds))[1]
    lever(command)
    lever(command, "--quick")
    assert flown[-2:] == [20, 3]


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--out", "x"), "--out is"),
        (("--format", "mf4"), "--format is"),
        (("--realtime",), "--realtime is"),
        (("--snapshots", "1"), "--snapshots is"),
        (("--settings",), "--settings without a file is"),
        (("--interface", "socketcan"), "--interface socketcan is"),
        (("--channel", "x"), "--channel is"),
        (("--bitrate", "500000"), "--bitrate is"),
        (("--bus-option", "a=1"), "--bus-option is"),
    ],
)
def test_what_is_for_a_single_run_is_not_for_seeds(option: tuple[str, ...], said: str, refused: Refused) -> None:
    assert f"{said} for a single run: leave out --seeds" in refused("sim", "steady", "--seeds", "2", *option)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("steady", "--seeds", "0"), "--seeds 0: must be at least 1"),
        (("steady", "--seeds", "2", "--jobs", "0"), "--jobs 0: must be at least 1"),
        (("steady", "--jobs", "2"), "--jobs is for --seeds"),
        (("steady", "--snapshots", "0.09"), "--snapshots 0.09: must be 0.1 to 10 s"),
        (("steady", "--snapshots", "10.1"), "--snapshots 10.1: must be 0.1 to 10 s"),
        (("steady", "--snapshots", "1", "--interface", "socketcan"), "--snapshots is for --interface lever"),
        (("nope", "--seeds", "2"), "no scenario 'nope'"),
    ],
)
def test_what_sim_refuses(arguments: tuple[str, ...], said: str, refused: Refused) -> None:
    assert said in refused("sim", *arguments)


def test_a_run_is_printed_as_its_summary_has_it(lever: Run, tmp_path: Path) -> None:
    file, out = tmp_path / "tables.json", tmp_path / "out"
    status, printed, _ = lever("sim", "bounce", *SHORT, "--out", out, "--json", file)
    tables, summary = json.loads(file.read_text()), json.loads((out / "summary.json").read_text())
    tables.pop("provenance")
    assert list(tables) == [scenario.load("bounce").title, "run", "collective bounce"]
    quantities, (row,), (bounced,) = tables.values()
    units = {each["quantity"]: each["unit"] for each in quantities}
    assert units["k_p"] == "N/m"
    assert units["natural_frequency"] == "Hz"
    for each in quantities:
        entry = summary["parameters"][each["quantity"]]
        for within in (5, 10):
            times = ["-" if time is None else f"{time:.1f}" for time in entry[f"time_to_{within}_percent_s"]]
            assert each[f"below {within} % after [s]"] == ", ".join(times)
        assert 0.0 < each["sigma"] < each["estimate"]
        assert each["truth at end"] > 0.0
    assert row == {
        "samples": 1000,
        **{name: summary[name] for name in ("unanswered", "lost", "corrupt", "late", "restarts")},
        "mean NIS [1]": summary["nis"]["mean"],
        "expected NIS [1]": summary["nis"]["expected"],
        "largest correlation [1]": summary["whiteness"]["largest"] if summary["whiteness"] else None,
        "simulated time [s]": 1.0,
        "computing time [s]": summary["wall_time_s"],
        "firmware": summary["firmware"]["version"],
    }
    assert bounced["least gain margin [dB]"] == summary["stability"]["least_margin_db"]
    assert bounced["sigma"] == summary["stability"]["its_sigma_db"]
    assert sum(value for name, value in bounced.items() if name.endswith(" [s]")) == pytest.approx(1.0, abs=0.03)
    assert f"Written to {out}: report.html, summary.json, trace.csv, bus.log" in " ".join(printed.split())
    assert status == 0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"unanswered": 3}, "3 samples without an answer"),
        ({"misplaced": 2}, "2 estimates are of other samples: is the port in --lock-step, and alone?"),
        ({"modes_s": {"fault": 1.0}}, "the estimator was in fault"),
        ({"missed": ["rms error of m_p is 9 %"]}, "rms error of m_p is 9 %"),
        ({"unanswered": 1, "missed": ["x"]}, "1 samples without an answer; x"),
    ],
)
def test_why_a_run_did_not_pass_is_said(
    changes: dict[str, Any], said: str, lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = {"unanswered": 0, "misplaced": 0, "modes_s": {"run": 1.0}, "missed": [], "verdict": "", "passed": False}
    result = SimpleNamespace(summary=SimpleNamespace(**(plain | changes)))
    monkeypatch.setattr(runner, "simulate", lambda *_, **__: result)
    monkeypatch.setattr(sim, "_tables", lambda _result: {})
    status, _, error = lever("sim", "steady")
    assert (status, error) == (1, f"lever: steady: {said}\n")


def test_runs_that_are_written_are_named(lever: Run, tmp_path: Path) -> None:
    data = tmp_path / "runs"
    chosen = ("--scenarios", "step_up", "--seeds", "2", "--duration", "2")
    status, printed, _ = lever("compare", "--data", data, *chosen)
    assert status == 0
    (line,) = [" ".join(printed.split())]
    names = sorted(path.name for path in data.iterdir())
    assert line == f"Written to {data}: {', '.join(sorted(names, key=lambda name: name.endswith('.parquet')))}"
    assert "step_up.parquet" in names


@pytest.mark.parametrize("option", ["scenarios", "models", "quick", "score", "data", "out"])
def test_the_experiment_of_the_paper_takes_no_other(option: str, refused: Refused) -> None:
    value = () if option == "quick" else ("lever",)
    assert f"--{option} does not go with --paper" in refused("compare", "--paper", f"--{option}", *value)


@pytest.mark.parametrize("option", ["estimators", "quick", "out"])
def test_runs_alone_have_no_estimators(option: str, refused: Refused, tmp_path: Path) -> None:
    value = () if option == "quick" else ("dual",)
    said = refused("compare", "--data", tmp_path / "runs", f"--{option}", *value)
    assert f"--{option} does not go with --data alone" in said


@pytest.mark.parametrize("option", ["seeds", "seed", "duration", "quick", "models"])
def test_runs_of_files_are_as_they_are(
    option: str, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    methods = "".join(f"    def {name}(self, *given): ...\n" for name in ("start", "step", "estimate"))
    (tmp_path / "nothing_much.py").write_text(f"class Nothing:\n{methods}")
    monkeypatch.syspath_prepend(tmp_path)
    value = () if option == "quick" else ("lever",) if option == "models" else ("2",)
    arguments = ("--data", tmp_path, "--score", "nothing_much:Nothing", f"--{option}", *value)
    assert f"--{option} does not go with --data, which has its own runs" in refused("compare", *arguments)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--jobs", "0"), "--jobs 0: must be at least 1"),
        (("--duration", "0.9"), "--duration 0.9: must be from 1 to 3600 s"),
        (("--duration", "3601"), "--duration 3601: must be from 1 to 3600 s"),
        (("--duration", "nan"), "--duration nan: must be from 1 to 3600 s"),
        (("--models", "levr"), "no model 'levr'; did you mean lever?"),
        (("--scenarios", "sudden_grip", "--models", "hand"), "no model 'hand'"),
        (("--scenarios", "step_up", "--models", "linear_physical"), "none of these estimators takes part"),
    ],
)
def test_what_compare_refuses(arguments: tuple[str, ...], said: str, refused: Refused) -> None:
    assert said in refused("compare", *arguments)


# --- aircraft --------------------------------------------------------------------------------------------------------


@pytest.fixture
def measured(tmp_path: Path) -> Callable[[float], Path]:
    """measured(gearing): the response of an aircraft at 30 frequencies, in a file, each off by some per cent."""

    def write(gearing: float) -> Path:
        frequency = np.geomspace(1.0, 10.0, 30)
        values = gearing * aircraft.load("puma_like").response(2j * np.pi * frequency.astype(np.complex128))
        values *= 1.0 + 0.05 * np.random.default_rng(1).standard_normal(30)
        file = tmp_path / "craft.csv"
        rows = (f"{f}, {z.real}, {z.imag}" for f, z in zip(frequency, values, strict=True))
        file.write_text("\n".join(rows), encoding="utf-8")
        return file

    return write


def test_a_fit_is_shown_beside_what_was_measured(measured: Callable[[float], Path], lever: Run, tmp_path: Path) -> None:
    file = measured(0.5)
    status, _, said = lever("aircraft", file, "response_gearing=0.5", "delay=20 ms", "-o", tmp_path / "x.response")
    assert status == 0
    first, heading, *lines = said.splitlines()
    found = re.fullmatch(rf"{re.escape(str(file))}: fitted by (\d+) states, off by ([\d.]+) % at most", first)
    assert found
    assert 1.0 < float(found[2]) < 10.0
    assert heading.split() == ["frequency", "response", "fitted", "off"]
    given = np.loadtxt(file, delimiter=",")
    cells = [re.findall(r"-?[\d.]+(?:e-\d+)?", line) for line in lines]
    assert len(cells) == 15
    assert [float(row[0]) for row in cells] == pytest.approx(given[::2, 0], rel=5e-3)
    for row, (_, real, imaginary) in zip(cells, given[::2], strict=True):
        size, phase, fitted, its_phase, off = map(float, row[1:])
        assert size == pytest.approx(math.hypot(real, imaginary), rel=1e-3)
        assert phase == pytest.approx(math.degrees(math.atan2(imaginary, real)), abs=0.06)
        apart = abs(fitted * np.exp(1j * math.radians(its_phase - phase)) / size - 1.0)
        assert 0.01 * off == pytest.approx(apart, abs=2e-3)


def test_a_state_space_says_how_many_states_fly(lever: Run, tmp_path: Path) -> None:
    file, out = tmp_path / "own.csv", tmp_path / "own.response"
    assert lever("aircraft", "puma_like", "--export", file) == (0, "", "")
    assert lever("aircraft", "--state-space", file, "gearing=0.5", "-o", out)[::2] == (
        *(0, f"{file}: {len(aircraft.load('puma_like').airframe().a)} states\n"),
    )
    table = [line for line in out.read_text().splitlines() if not line.startswith("#")]
    known = [line for line in lever("aircraft", "puma_like", "gearing=0.5")[1].splitlines() if not line.startswith("#")]
    ours, theirs = (np.array(re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", " ".join(each)), float) for each in (table, known))
    np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (("gearing",), "gearing: must be KEY=VALUE"),
        (("gearing=0.5", "gearing=0.6"), "gearing=0.6: gearing is given twice"),
        (("gearing=0.5 m",), "gearing: "),
        (("mass_of=3",), "mass_of"),
    ],
)
def test_changes_of_an_aircraft_that_are_refused(changes: tuple[str, ...], said: str, refused: Refused) -> None:
    assert said in refused("aircraft", "puma_like", *changes)


def test_what_is_said_of_a_response_is_in_its_table(lever: Run) -> None:
    def table(*changes: str) -> dict[str, str]:
        lines = lever("aircraft", "puma_like", *changes)[1].splitlines()
        parts = (line.partition("#")[0].partition("=") for line in lines)
        return {name.strip(): value.strip() for name, equals, value in parts if equals}

    usual, other = table(), table("gain_sigma=0.1", "phase_sigma=0.2", "warning=6 dB", "alarm=3")
    assert {name: float(usual[name]) for name in ("gain_sigma", "phase_sigma")} == {
        "gain_sigma": 0.05, "phase_sigma": 0.05
    }  # fmt: skip
    assert [float(other[name]) for name in ("gain_sigma", "phase_sigma", "warning", "alarm")] == [0.1, 0.2, 6.0, 3.0]


def test_a_response_has_no_keys_of_an_airframe(measured: Callable[[float], Path], refused: Refused) -> None:
    said = refused("aircraft", measured(0.5), "gearing=0.4")
    assert "a response has no gearing; it may have gain_sigma, phase_sigma, warning, alarm, response_gearing" in said
    assert "must begin with a line `states, N`" in refused("aircraft", "--state-space", measured(0.5))


# --- what is run -----------------------------------------------------------------------------------------------------


class StoppedError(Exception):
    """Instead of a run."""


def asked(lever: Run, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> tuple[set[str], set[str], cases.Plan]:
    """Return the cases and estimators that `lever compare` would run, and how much of each."""
    found: list[Any] = []

    def tasks(*given: Any) -> list[Any]:
        found.extend((given[2], task_list(*given)))
        raise StoppedError

    task_list = run_cases.tasks
    with monkeypatch.context() as patched:
        patched.setattr(run_cases, "tasks", tasks)
        with pytest.raises(StoppedError):
            lever("compare", *arguments)
    plan, todo = found
    return {task.case for task in todo}, {task.entrant for task in todo if task.entrant is not None}, plan


def test_compare_runs_what_is_asked_for(lever: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    everything = cases.cases()
    usual = {name for name, case in everything.items() if case.kind not in ("paper", "wrong tuning", "protocol")}
    ours = {"dual", "joint", "dual_shipped", "joint_shipped"}
    names, estimators, plan = asked(lever, monkeypatch)
    assert (names, plan) == (usual, cases.Plan(40, None, 1))
    assert estimators >= {*BASELINES, *ours, "dual_r10_q0.1"}
    names, estimators, plan = asked(lever, monkeypatch, "--quick")
    assert names == {"lever_fixed_dither_rough", "linear_black_box_trim_base_rough", "step_up", "steady"}
    assert plan == cases.Plan(8, 12.0, 1)
    names, estimators, plan = asked(
        lever, monkeypatch, "--scenarios", "step_up", "steady", "--estimators", "rls", "dual_shipped",
        *("--seeds", "3", "--seed", "7", "--duration", "5"),
    )  # fmt: skip
    assert (names, estimators, plan) == ({"step_up", "steady"}, {"rls", "dual_shipped"}, cases.Plan(3, 5.0, 7))
    assert asked(lever, monkeypatch, "--quick", "--seeds", "2", "--duration", "3")[2] == cases.Plan(2, 3.0, 1)
    names = asked(lever, monkeypatch, "--models", "linear_black_box")[0]
    assert names == {name for name in usual if everything[name].model == "linear_black_box"}
    methods = "".join(f"    def {name}(self, *given): ...\n" for name in ("start", "step", "estimate"))
    (tmp_path / "of_mine.py").write_text(f"class Mine:\n{methods}")
    monkeypatch.syspath_prepend(tmp_path)
    names, estimators, plan = asked(lever, monkeypatch, "--score", "of_mine:Mine")
    assert names == {"lever_trim_dither_rough", "step_up"}
    assert estimators == {"of_mine:Mine", "dual_shipped", "joint_ekf"}
    assert plan == cases.Plan(20, None, 1)
    estimators = asked(lever, monkeypatch, "--score", "of_mine:Mine", "--estimators", "rls")[1]
    assert estimators == {"of_mine:Mine", "rls"}


def test_the_experiment_of_the_paper_is_run_by_twenty_seeds(lever: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    names, estimators, plan = asked(lever, monkeypatch, "--paper")
    assert names == {name for name, case in cases.cases().items() if case.kind == "paper"}
    assert estimators >= {"algorithm1", "dual_annealing", "joint_robbins_monro"}
    assert plan == cases.Plan(20, None, 1)
    some = ("--estimators", "rls", "--seeds", "2", "--seed", "3", "--duration", "4")
    assert asked(lever, monkeypatch, "--paper", *some)[1:] == ({"rls"}, cases.Plan(2, 4.0, 3))


@pytest.mark.parametrize(
    ("arguments", "names", "seeds", "estimators"),
    [
        ((), set(envelope.CONDITIONS), 8, ["firmware", "joint_ekf", "joint_ukf", "joint_ekf_hp", "joint_ukf_hp"]),
        (
            ("--quick", "--estimators", "joint_ekf", "firmware"),
            {name for name, each in envelope.CONDITIONS.items() if each.quick}, 8, ["firmware", "joint_ekf"],
        ),
        (
            ("--scenarios", "retrim", "steady", "--seeds", "3", "--estimators", "joint_ukf_hp"),
            {"steady", "retrim"}, 3, ["joint_ukf_hp"],
        ),
    ],
)  # fmt: skip
def test_filters_beside_the_firmware_are_run_where_they_are_asked_for(
    arguments: tuple[str, ...], names: set[str], seeds: int, estimators: list[str], lever: Run,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    def run(wanted: list[str], of: int, by: list[str], jobs: int, _show: Any) -> None:
        assert (set(wanted), of, sorted(by), jobs) == (names, seeds, sorted(estimators), 2)
        raise StoppedError

    monkeypatch.setattr(run_estimators, "run", run)
    with pytest.raises(StoppedError):
        lever("compare", "--envelope", *arguments, "--jobs", "2")


@pytest.mark.parametrize(
    ("arguments", "names", "seeds"),
    [
        ((), set(ROWS), 3),
        (("--quick",), {name for name, row in ROWS.items() if row.quick}, 1),
        (("--only", "theta_stuck", "lever_crc", "theta_stuck", "--seeds", "7"), {"theta_stuck", "lever_crc"}, 7),
        (("--quick", "--seeds", "2"), {name for name, row in ROWS.items() if row.quick}, 2),
    ],
)
def test_faults_are_flown_that_are_asked_for(
    arguments: tuple[str, ...], names: set[str], seeds: int, lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(chosen: list[Any], of: int, _show: Any) -> None:
        assert len(chosen) == len(names)
        assert ({row.name for row in chosen}, of) == (names, seeds)
        raise StoppedError

    monkeypatch.setattr(matrix, "run", run)
    with pytest.raises(StoppedError):
        lever("faults", *arguments)
