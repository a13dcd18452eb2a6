"""The firmware beside joint EKF and UKF on the logs of `lever envelope`."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.cli.main import main
from lever_sil.batch.firmware import ClosedLoop
from lever_sil.batch.motions import FREQUENCIES, PERIOD, Motion
from lever_sil.batch.sensors import Sensors
from lever_sil.envelope import conditions
from lever_sil.envelope.condition import Condition
from lever_sil.envelope.measure import FIGURES, Outcome
from lever_sil.plants.sensors import INVALID, Reads
from lever_sil.study.compare_envelope import filters, logs, run_estimators, tables
from lever_sil.study.compare_envelope.run_estimators import ESTIMATORS, EstimatorResult
from lever_sil.study.data import Batch, Estimates
from numpy.typing import NDArray
from python.conftest import Refused

Array = NDArray[Any]  # of floats
SHORT = Motion(duration=6.0)
MOVED = Condition("moved", "±5° at 0.3 Hz", dataclasses.replace(SHORT, trim=conditions.sway(5.0, 0.3)), start=4.0)


# --- the high-pass ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [0.3, 1.0, 4.0])
def test_high_pass_is_two_butterworths_of_second_order(frequency: float) -> None:
    """Each passes 1 / sqrt(1 + (corner / frequency)^4) of a sine; of a constant that has always been, nothing."""
    time = np.arange(0.0, 20.0, PERIOD)
    sine = np.sin(2.0 * np.pi * frequency * time)
    passed = filters.high_pass((0.4 + sine)[:, np.newaxis], 1.0, np.array([0.4]))[:, 0]
    late = slice(round(10.0 / PERIOD), None)  # whole periods
    expected = 1.0 / (1.0 + frequency**-4)
    assert np.sqrt(2.0 * np.mean(passed[late] ** 2)) == pytest.approx(expected, rel=2e-3)
    np.testing.assert_allclose(filters.high_pass(np.full((50, 2), 0.4), 1.0, np.full(2, 0.4)), 0.0, atol=1e-9)


# --- logs ------------------------------------------------------------------------------------------------------------


def test_logs_say_what_the_sensors_said() -> None:
    short = Motion(duration=0.5)
    invalid = Sensors(faults=(("z_ddot", Reads(value=INVALID, start=0.2, end=0.3)),))
    chunk = (Condition("a", "", short), Condition("b", "", short, sensors=invalid), Condition("c", "", short, runs=2))
    first, second, third = (logs.log_of(condition, 2) for condition in chunk)
    np.testing.assert_array_equal(second.recording.theta, first.recording.theta)
    assert third.recording.theta.shape == (501, 4)
    np.testing.assert_array_equal(third.recording.theta[:, :2], first.recording.theta)
    np.testing.assert_allclose(first.trim, first.recording.theta[0])
    assert not np.isnan(first.signals["z_ddot"]).any()
    assert np.isnan(second.signals["z_ddot"][210:290]).all()
    assert first.firmware is not None
    whole = Condition("whole", "", short, closed_loop=ClosedLoop(whole=True))
    log = logs.log_of(whole, 2)
    gone = np.isnan(log.signals["theta"])
    assert 0.4 < gone.mean() < 0.6
    np.testing.assert_array_equal(np.isnan(log.signals["z_ddot"]), gone)


# --- the joint filters ----------------------------------------------------------------------------------------------


def measured(log: logs.Log, name: str) -> tuple[float, float]:
    """Return median rms error of the natural frequency [%], and coverage [%]."""
    track = filters.track(log, filters.JOINT_FILTERS[name])
    outcome = Outcome(log.recording, track, log.condition.window)
    return tuple(float(np.median(FIGURES[f"f_n {what}"].compute(outcome))) for what in ("rms", "covered"))  # type: ignore[return-value]


def test_movement_needs_the_high_pass() -> None:
    log = logs.log_of(MOVED, 2)
    for name in filters.JOINT_FILTERS:
        rms, covered = measured(log, name)
        assert (rms < 5.0) == (covered > 60.0) == name.endswith("_hp"), (name, rms, covered)


def test_steady_flight_does_not_and_missing_samples_are_skipped() -> None:
    faults = (
        ("theta", Reads(value=INVALID, start=1.0, end=1.5)),
        ("z_ddot", Reads(value=INVALID, start=2.0, end=2.2)),
    )
    log = logs.log_of(Condition("steady", "", SHORT, sensors=Sensors(faults=faults), start=4.0), 8)
    for name in filters.JOINT_FILTERS:
        rms, covered = measured(log, name)
        assert rms < 4.0, name
        assert covered > 60.0, name


def test_feedthrough_is_as_uncertain_as_a_cloud_of_parameters() -> None:
    """The lever's transfer function written out, at a trim of 20 degrees."""
    log = logs.log_of(Condition("still", "", Motion(duration=0.2)), 1)
    log = dataclasses.replace(log, trim=np.radians([20.0]))
    peer = filters.JointFilter("", fixed, False)
    found = filters.track(log, peer).feedthrough
    assert found is not None
    m_p, c_p, k_p = np.array([2.5, 42.0, 1500.0])[:, None, None] * np.exp(
        0.01 * np.random.default_rng(1).standard_normal((3, 50_000, 1))
    )
    s, rise, mu = 2j * np.pi * FREQUENCIES, 0.45 * np.cos(np.radians(20.0)), 0.6 + m_p
    inertia = 0.45**2 * (0.3 + m_p) + 0.020
    cloud = -rise * mu / (inertia * s**2 + (rise**2 * c_p + 0.5) * s + rise**2 * k_p + 5.0)
    np.testing.assert_allclose(found.response[0, 0], cloud.mean(axis=0), rtol=2e-3)
    ratio = cloud / found.response[0, 0]
    np.testing.assert_allclose(found.gain_sigma[0, 0], np.abs(ratio).std(axis=0), rtol=0.03)
    np.testing.assert_allclose(found.phase_sigma[0, 0], np.angle(ratio).std(axis=0), rtol=0.03)


def fixed(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Stays at the first guess, 1 % uncertain."""
    covariance = 1e-4 * np.broadcast_to(np.eye(3), (batch.runs, len(at), 3, 3))
    return Estimates(at, np.zeros((batch.runs, len(at), 3)), covariance)


def test_progress_counts_conditions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_estimators, "do", lambda _task: [])
    shown: list[tuple[int, int, str]] = []
    assert run_estimators.run(["a", "b"], 1, (), 1, lambda *step: shown.append(step)) == []
    assert shown == [(1, 2, "a"), (2, 2, "b")]


# --- how it is said --------------------------------------------------------------------------------------------------


def results(case: str, runs: int, **rms: float) -> list[EstimatorResult]:
    """Return errors about these, alike in all runs but for 10 %."""
    size = 1.0 + 0.1 * np.random.default_rng(1).standard_normal(runs)
    scatter = 1.0 + 0.01 * np.random.default_rng(2).standard_normal((len(rms), runs))
    return [
        EstimatorResult(case, name, value * size * own, np.full(runs, 95.0))
        for (name, value), own in zip(rms.items(), scatter, strict=True)
    ]


def test_verdicts_are_of_significant_differences() -> None:
    found = results("a", 8, firmware=2.0, joint_ekf=3.0, joint_ukf=np.inf)
    found += results("b", 8, firmware=2.0, joint_ekf=1.0) + results("c", 8, firmware=2.0, joint_ekf=2.001)
    assert list(tables.verdicts(found)) == [
        "The firmware's errors against joint_ekf: smaller in 1 conditions, larger in 1 (b), no significant difference "
        "in 1."
    ]
    assert list(tables.verdicts(results("a", 7, firmware=2.0))) == [
        "Too few runs for a verdict: at least 8 are needed."
    ]


def test_a_table_has_median_and_worst() -> None:
    one = EstimatorResult("a", "firmware", np.array([1.0, 2.0, np.inf]), np.array([90.0, 95.0, 0.0]))
    errors, coverage = tables.tables([one], 3).values()
    assert errors == [{"condition": "a", "firmware": "2 / ∞"}]
    assert coverage == [{"condition": "a", "firmware": "90 / 0"}]


def test_rows_have_median_and_worst_as_numbers() -> None:
    one = EstimatorResult("a", "joint_ekf", np.array([1.0, 2.0, 6.0]), np.array([90.0, 95.0, 10.0]))
    assert tables.rows([one]) == [
        {
            "condition": "a", "estimator": "joint_ekf", "runs": 3, "rms median [%]": 2.0, "rms worst [%]": 6.0,
            "covered median [%]": 90.0, "covered worst [%]": 10.0,
        }
    ]  # fmt: skip
    titles = list(tables.tables([one], 3))
    assert titles == [
        "rms error of f_n (θ/z̈ of other pilots) [%], median / worst of 3 pilots or more",
        "share of time within ±2σ [%], median / worst of 3 pilots or more",
    ]


def test_an_estimator_that_was_not_run_in_a_condition_has_an_empty_cell() -> None:
    both = results("a", 3, firmware=1.0, joint_ekf=2.0) + results("b", 3, firmware=1.0)
    errors, _ = tables.tables(both, 3).values()
    assert [list(row) for row in errors] == [["condition", "firmware", "joint_ekf"]] * 2
    assert (errors[1]["condition"], errors[1]["joint_ekf"]) == ("b", "")


def test_who_broke_down_is_not_compared_and_who_is_larger_is_named() -> None:
    found = results("a", 8, firmware=2.0, joint_ekf=1.0, joint_ukf=3.0) + results("b", 8, joint_ekf=1.0)
    assert list(tables.verdicts(found)) == [
        "The firmware's errors against joint_ekf: smaller in 0 conditions, larger in 1 (a), no significant difference "
        "in 0.",
        "The firmware's errors against joint_ukf: smaller in 1 conditions, larger in 0, no significant difference in "
        "0.",
    ]
    assert tables.differences(results("a", 8, firmware=2.0, joint_ekf=np.inf)) == {}


def test_of_pilots_without_a_natural_frequency_the_feedthrough_is_compared() -> None:
    arm, hand = conditions.CONDITIONS["steady"], conditions.CONDITIONS["mayo_ectomorphic"]
    assert run_estimators.figures(arm) == ("f_n rms", "f_n covered")
    assert run_estimators.figures(hand) == ("θ/z̈ rms", "θ/z̈ covered")


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    short = Condition("short", "title", Motion(duration=1.0), start=0.5, quick=True)
    slow = Condition("slow", "title", Motion(duration=100.0))
    monkeypatch.setattr(conditions, "CONDITIONS", {"short": short, "slow": slow})
    file = tmp_path / "peers.json"
    quick = ("compare", "--envelope", "--quick", "--seeds", "2", "--jobs", "1", "--json", str(file))
    assert main(quick) == 0
    printed = capsys.readouterr().out
    assert "Too few runs for a verdict" in printed
    written = json.loads(file.read_text())["peers"]
    assert [(row["condition"], row["estimator"]) for row in written] == [("short", name) for name in ESTIMATORS]
    assert all(row["runs"] == 2 and row["rms median [%]"] > 0.0 for row in written)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenarios", "steadi"), "no condition 'steadi'; did you mean steady?"),
        (("--estimators", "rls"), "no estimator 'rls'; `lever compare --envelope --list` lists them all"),
        (("--duration", "9"), "--duration does not go with --envelope"),
        (("--seed", "9"), "--seed does not go with --envelope"),
        (("--seeds", "0"), "--seeds 0: must be at least 1"),
    ],
)
def test_what_is_wrong_is_one_line(arguments: tuple[str, ...], said: str, refused: Refused) -> None:
    assert said in refused("compare", "--envelope", *arguments)


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(("compare", "--envelope", "--list")) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in (*conditions.CONDITIONS, *ESTIMATORS))
