"""Median, worst and coverage over runs, against figures worked out by hand; runs in processes against a single one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.results.nis import Nis
from lever_cdkf.results.summary import Estimator, Firmware, Quality, Scenario, SimulationSummary, Truth
from lever_cdkf.results.whiteness import Whiteness
from lever_cdkf.runtime import interrupts
from lever_sil.run import seeds
from python.conftest import Refused, Run

SHORT = ("duration=1 s", "converged_after=0.2 s")


def summary(
    seed: int,
    rms: float | None,
    covered: float | None,
    times: list[float | None],
    unanswered: int = 0,
    modes_s: dict[str, float] | None = None,
) -> SimulationSummary:
    """Return one of a made-up run with one quantity."""
    return SimulationSummary(
        scenario=Scenario("made", "made", "", seed, 1e-3, 0.0, [0.0], {"m_p": 0.05, "coverage": 0.6}),
        estimator=Estimator("lever", "trim", "dual", "annealing", "none", {}),
        truth=Truth("lever"),
        parameters={"m_p": Quality(rms, 0.0, covered, [], times)},
        nis=Nis(mean=2.0 + 0.1 * seed, expected=2.0),
        whiteness=Whiteness(0.02, [], 0.1, -0.1 * seed, 0.02, seed < 2),
        fault_shares={"bound": 0.5} if seed == 2 else {},
        flagged_share=0.5 if seed == 2 else 0.0,
        samples=10, simulated_time_s=0.01, firmware=Firmware("1.0.0", None, None),
        lost=0, corrupt=0, late=0, restarts=0, misplaced=0, missed=[],
        passed=True, verdict="", unanswered=unanswered, modes_s=modes_s or {},
    )  # fmt: skip


RUNS = [summary(1, 1.0, 1.0, [2.0, 1.0]), summary(2, 9.0, 0.2, [3.0, None]), summary(3, 3.0, 0.9, [4.0, 0.5])]


def test_rows_are_median_worst_and_coverage() -> None:
    quantities, faults, runs = seeds.tables(RUNS).values()
    assert quantities == [
        {
            "quantity": "m_p",
            "rms median [%]": 3.0, "rms worst [%]": 9.0, "worst seed": 2,
            "coverage [%]": pytest.approx(70.0), "coverage median [%]": 90.0, "coverage worst [%]": 20.0,
            "to 5 % median [s]": 2.5, "to 5 % worst [s]": None, "never to 5 % [%]": 16.67,
        }
    ]  # fmt: skip
    assert [list(row.values()) for row in faults] == [["bound", 0.0, 50.0, 1], ["any that warns", 0.0, 50.0, 1]]
    assert runs[0]["NIS / expected median [1]"] == pytest.approx(1.1)
    assert runs[0]["correlation largest [1]"] == pytest.approx(0.3)
    assert next(iter(seeds.tables(RUNS))) == "made (3 seeds, 1 to 3)"


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        (RUNS, []),  # the median keeps what the worst run misses
        ([RUNS[1]] * 2 + RUNS, ["rms error of m_p 9.0 % (limit 5 %)", "coverage of m_p 50 % (limit 60 %)"]),
        ([summary(1, None, None, [None])], []),  # too short to judge
        ([summary(1, None, None, [None])] * 2 + RUNS[:1], ["rms error of m_p inf %", "coverage of m_p 33.3 %"]),
    ],
)
def test_limits_are_for_the_median_error_and_all_coverage(runs: list[Any], expected: list[str]) -> None:
    missed = seeds.missed(runs)
    assert len(missed) == len(expected)
    assert all(line.startswith(start) for line, start in zip(missed, expected, strict=True))


def test_the_verdict_says_what_was_tested_and_what_that_cannot_see() -> None:
    said = seeds.verdict(RUNS)
    assert said.startswith(
        "All limits kept. Over all runs ±2σ covers every truth for at least 70 % of the time (least: m_p)."
    )
    assert "Residuals of 2 of 3 runs are coloured. That test does not see friction" in said
    assert seeds.verdict([summary(1, None, None, [None])]).startswith("Too short to judge")


def test_troubles_name_their_seeds() -> None:
    runs = [RUNS[0], summary(4, 1.0, 1.0, [1.0], unanswered=3, modes_s={"fault": 0.1}), summary(5, 1.0, 1.0, [1.0])]
    assert seeds.troubles(runs) == ["samples without an answer with seed 4", "the estimator in fault with seed 4"]


def test_a_run_in_a_process_is_the_single_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interrupts, "START", 0.0)
    tasks = [seeds.Task("steady", seed, SHORT) for seed in (5, 6)]
    calls: list[tuple[int, int, str]] = []
    apart = seeds.run(tasks, jobs=2, progress=lambda *progress: calls.append(progress))
    assert [each.scenario.seed for each in apart] == [5, 6]
    assert calls == [(1, 2, "steady, seed 5"), (2, 2, "steady, seed 6")]
    assert apart[0].parameters != apart[1].parameters
    sets = (f"--set={override}" for override in (*SHORT, "limits={}"))
    assert main(["sim", "steady", "--seed", "5", *sets, "--json", str(tmp_path / "single.json")]) == 0
    single = next(iter(json.loads((tmp_path / "single.json").read_text()).values()))
    errors = {row["quantity"]: row["rms error [%]"] for row in single}
    assert errors == {key: entry.rms_percent for key, entry in apart[0].parameters.items()}
    capsys.readouterr()


STEADY = ("sim", "steady", *(f"--set={override}" for override in SHORT))


def test_seeds_on_the_command_line(lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "worker_pool", None)  # not called for one process, or one seed
    file = tmp_path / "seeds.json"
    arguments = ("--seeds", "2", "--seed", "7", "--jobs", "1", "--json", str(file))
    status, out, err = lever(*STEADY, *arguments, "--set", "limits={ m_p = '0.001 %' }")
    assert status == 1
    assert err.startswith("lever: steady: rms error of m_p")
    assert "Limits missed: rms error of m_p" in out
    title, *others = json.loads(file.read_text())
    assert title.endswith("(2 seeds, 7 to 8)")
    assert others == ["share of the judged time with each fault", "runs", "provenance"]
    assert all(column in out for column in ("rms median [%]", "coverage [%]", "to 5 % median [s]"))
    alone = ("--seeds", "1", "--jobs", "2", "--set", "limits={}")
    assert lever(*STEADY, *alone)[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seeds", "0"), "--seeds 0: must be at least 1"),
        (("--seeds", "2", "--jobs", "0"), "--jobs 0: must be at least 1"),
        (("--seeds", "2", "--out", "x"), "--out is for a single run: leave out --seeds"),
        (("--seeds", "2", "--interface", "socketcan"), "--interface socketcan is for a single run"),
        (("--seeds", "2", "--settings"), "--settings without a file is for a single run"),
        (("--seeds", "2", "--set", "pilot.m_p=3"), "lever: error: --set pilot.m_p=3: pilot.m_p: 3 is not a quantity"),
        (("--jobs", "2"), "--jobs is for --seeds"),
    ],
)
def test_what_does_not_go_together_is_one_line(arguments: tuple[str, ...], message: str, refused: Refused) -> None:
    assert message in refused(*STEADY, *arguments)
