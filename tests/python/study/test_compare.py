"""`lever compare`: who takes part in what, what is made of it, and how it is said."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.native import enum_names, settings_table
from lever_cdkf.report import figure as drawing
from lever_cdkf.report.printed import charts as sheet_of
from lever_cdkf.runtime import interrupts
from lever_cdkf.runtime.provenance import provenance
from lever_sil.scenarios import scenario
from lever_sil.study.baselines import BASELINES
from lever_sil.study.compare import charts, compare_page, comparison, evaluation, printed, run_cases, table, verdicts
from lever_sil.study.compare.cases import ON_REQUEST, Matched, Plan, References, Stepped, cases
from lever_sil.study.compare.entrants import entrants, tuning_name, wrongly_tuned
from lever_sil.study.compare.evaluation import Row
from lever_sil.study.compare.run_cases import Outcome, Results
from lever_sil.study.data import Batch, Estimates
from numpy.typing import NDArray
from python.conftest import Refused, Run
from python.report.reading import Reader, figures, unpack

# --- who takes part ---------------------------------------------------------------------------------------------------

MODELS = [model for model in enum_names("lever_model").values() if model != "hand"]
"""The hand needs the base's velocity, which the baselines have not: `lever envelope` measures it."""


def test_every_model_and_estimator_of_the_firmware_is_compared() -> None:
    walks = [case for case in cases().values() if case.kind == "matched"]
    for model in MODELS:
        for preload in enum_names("lever_preload").values():
            own = [case for case in walks if (case.model, case.preload) == (model, preload)]
            assert len({case.noise["theta_dot_process_noise"] for case in own}) >= 2, (model, preload)
            for case in own:
                assert entrants(case).keys() >= set(enum_names("lever_estimator").values())


def test_every_baseline_takes_part_with_every_model() -> None:
    for model in MODELS:
        own = [case for case in cases().values() if case.model == model and case.kind == "matched"]
        there = {name for case in own for name in entrants(case)}
        assert there >= BASELINES.keys(), model


def test_walks_and_steps_are_as_the_comparison_was_asked_for() -> None:
    for name, case in cases().items():
        if isinstance(case, Matched):
            fixed, dithered, rough = (word in name for word in ("fixed", "dither", "rough"))
            if case.kind.startswith("wrong"):
                dithered, noise = True, 0.05
            else:
                noise = 0.1 if rough else 0.01
            assert (case.preload, case.dither_rms) == ("fixed" if fixed else "trim", 0.3 if dithered else 0.0)
            assert case.noise == {"theta_dot_process_noise": noise}
            assert sorted(case.own_settings.values()) == ([] if case.model == "linear_black_box" else [0.25, 0.3, 0.3])
            assert (case.duration, case.every) == (60.0, 0.1)
        elif isinstance(case, Stepped):
            assert (case.step.factor, case.step.at) == (0.7 if "down" in name else 1.3, 25.0)
            assert case.noise == {"theta_dot_process_noise": 0.1 if "rough" in name else 0.05}
            assert (case.duration, case.every, case.own_settings) == (45.0, 0.02, {})
    assert len([case for case in cases().values() if case.kind == "matched"]) == 2 * 2 * (2 + 2 + 1)
    assert len([case for case in cases().values() if case.kind == "step"]) == 2 * 3


def test_a_scenario_is_judged_as_it_judges_itself() -> None:
    case, time = cases()["sudden_grip"], np.arange(0.0, 60.0, 0.5)
    wanted = scenario.load("sudden_grip")
    jump = wanted.changes()[-1]
    assert (case.own_settings, case.change(Plan())) == (wanted.settings or {}, jump)
    assert case.change(Plan(duration=0.5 * jump)) is None
    assert (case.runs(Plan(7)), case.runs(Plan(40))) == (7, 20)
    converging = [(time >= start) & (time < start + wanted.converged_after) for start in wanted.changes()]
    np.testing.assert_array_equal(case.judged(time, Plan()), ~np.any(converging, axis=0))
    assert cases()["steady"].change(Plan()) is None


def test_told_the_wrong_noise_in_all_combinations() -> None:
    by_name = entrants(cases()["wrong_noise_fixed"])
    combinations = {(r, q) for r in ("0.1", "1", "10") for q in ("0.1", "1", "10")}
    default = {row.name: row.default for row in settings_table()}
    for name in ("dual", "joint"):
        assert {f"{name}_r{r}_q{q}" for r, q in combinations} <= by_name.keys()
        assert by_name[f"{name}_r10_q0.1"].reference == name
        misinformed: Any = by_name[f"{name}_r10_q0.1"].make(cases()["wrong_noise_fixed"])
        for told, factor in (("theta_noise", 10.0), ("theta_dot_noise", 10.0), ("theta_dot_process_noise", 0.1)):
            assert misinformed.settings[told] == factor * default[told]


def test_tuned_wrong_alone_and_in_pairs() -> None:
    """Of two things each, both ways; what leaves the range of its setting stays at the end of it."""
    case = cases()["wrong_tuning_trim"]
    assert len(list(wrongly_tuned())) == 1 + 4 * 2 + 6 * 2 * 2
    assert len({tuning_name(wrong) for wrong in wrongly_tuned()}) == 1 + 4 * 2 + 6 * 2 * 2
    made: Any = entrants(case)["dual_prior10_walk0.1"].make(case)
    assert made.settings == {
        **{f"{name}_sigma": 1.5 for name in ("m_p", "c_p", "k_p")},
        **{f"{name}_walk": 0.1 * setting(f"{name}_walk").default for name in ("m_p", "c_p", "k_p")},
    }
    made = entrants(case)["dual_prior0.1"].make(case)
    assert made.settings["m_p_sigma"] == pytest.approx(0.025)
    assert not {"paper", "wrong tuning"} - set(ON_REQUEST)


@pytest.mark.parametrize(
    "name", ["lever_fixed_dither_quiet", "lever_trim_base_rough", "wrong_noise_trim", "wrong_tuning_fixed", "step_up"]
)
def test_the_firmware_takes_the_settings_of_each_entrant(name: str) -> None:
    case, plan = cases()[name], Plan(1, 1.0)
    batch = case.batch(plan)
    at = run_cases.samples(case, batch)
    for entrant in entrants(case).values():
        if entrant.ours:
            assert np.isfinite(entrant.make(case)(batch, at).w).all(), entrant.name


def test_moments_move_with_the_duration() -> None:
    case = cases()["step_up"]
    assert case.change(Plan()) == 25.0
    assert case.change(Plan(duration=9.0)) == pytest.approx(5.0)
    time = np.arange(0.5, 45.0, 1.0)
    assert time[case.judged(time, Plan())].tolist() == [15.5 + i for i in range(10)]


# --- what is made of it ----------------------------------------------------------------------------------------------


def made_up(errors: NDArray[Any], time: NDArray[Any], stated: float = 1.0) -> Outcome:
    """Return an outcome with these errors (B, T, 5) and stated variances."""
    nees = np.sum(np.square(errors[..., :3]), axis=-1) / stated
    return Outcome(time, errors, errors, np.full_like(errors, stated), nees, None, 2e-3, 1000)


def one_row(outcome: Outcome, references: References | None = None) -> Row:
    case, plan = "lever_fixed_dither_quiet", Plan(len(outcome.errors))
    results = Results(plan, {(case, "joint"): outcome}, {} if references is None else {case: references})
    (row,) = evaluation.judge(results)
    return row


def test_a_row_of_known_errors() -> None:
    """Errors twice the reference, drawn with the stated variance: the window of judgement is from 15 s on."""
    time = np.arange(1.0, 61.0)
    errors = 0.2 * np.random.default_rng(3).standard_normal((200, 60, 5))
    errors[:, time < 15.0] = 7.0
    references = References(np.full_like(errors, 0.01), np.full((60, 5), 0.0064))
    row = one_row(made_up(errors, time, 0.04), references)
    assert row.rms == pytest.approx([0.2] * 5, rel=0.03)
    assert row.linearised == pytest.approx([2.0] * 5, rel=0.03)
    assert row.bound == pytest.approx([2.5] * 5, rel=0.03)
    assert row.linearised_error == pytest.approx([2.0 / math.sqrt(2 * 200 * 46)] * 5, rel=0.3)
    assert row.sigma_ratio == pytest.approx([1.0] * 5, rel=0.03)
    assert row.nees == pytest.approx(3.0, rel=0.03)
    assert (row.nees_low, row.nees_high) == pytest.approx((2.67, 3.35), abs=0.01)  # chi-square, 600 degrees, ÷ 200
    assert row.nees_inside > 0.8
    assert row.score == pytest.approx(0.2, rel=0.03)
    assert (row.runs, row.failures, row.ranked) == (200, 0, True)
    assert row.microseconds == pytest.approx(2.0)


def test_runs_that_break_down_are_counted_and_left_out() -> None:
    time = np.arange(1.0, 61.0)
    errors = np.full((4, 60, 5), 0.1)
    errors[2, 30:] = np.nan
    row = one_row(made_up(errors, time))
    assert (row.runs, row.failures, row.ranked) == (4, 1, False)
    assert row.rms == pytest.approx([0.1] * 5)
    row = one_row(made_up(np.full_like(errors, np.nan), time))
    assert row.failures == 4
    assert math.isnan(row.score)


def test_settling_of_known_errors() -> None:
    time = np.arange(0.02, 45.0, 0.02)
    errors = np.zeros((3, len(time), 5))
    for run, seconds in enumerate((0.5, 1.0, 3.0)):
        errors[run, (time > 25.0) & (time < 25.0 + seconds), 3] = -0.1
    errors[:, time < 24.0] = 0.3  # before the step: nothing to do with it
    outcome = made_up(errors, time)
    row = evaluation.judge(Results(Plan(3), {("step_up", "dual_shipped"): outcome}, {}))[0]
    assert (row.settled_median, row.settled_worst) == pytest.approx((1.0, 3.0), abs=0.021)
    errors[1, -1, 3] = 0.1
    row = evaluation.judge(Results(Plan(3), {("step_up", "dual_shipped"): made_up(errors, time)}, {}))[0]
    assert row.settled_worst == math.inf


def test_errors_of_signed_parameters_are_relative_to_the_truth() -> None:
    batch: Batch = cases()["linear_black_box_fixed_base_quiet"].batch(Plan(2, 1.0))
    at = np.array([500, 900])
    assert batch.truth.p is not None
    w = batch.knowledge.scaled(1.1 * batch.truth.p[:, at])
    outcome = run_cases.outcome(batch, Estimates(at, w, None), 1.0)
    np.testing.assert_allclose(np.abs(outcome.relative[..., :3]), 0.1, rtol=1e-9)


# --- who has smaller errors than whom ---------------------------------------------------------------------------------


def drawn(runs: int, seed: int, ratio: float) -> dict[str, NDArray[Any]]:
    """Return mean squares of two estimators whose errors are alike run by run, but for a factor and some of their
    own."""
    rng = np.random.default_rng(seed)
    size = np.exp(0.3 * rng.standard_normal((runs, 1)))
    own = (1.0 + 0.05 * rng.standard_normal((runs, 5)) for _ in range(2))
    return {name: np.square(size * one * factor) for name, one, factor in zip("ab", own, (ratio, 1.0), strict=True)}


def test_differences_are_of_pairs_of_runs() -> None:
    """Runs differ by 30 %, estimators by 10 %: only run by run is that seen."""
    found = comparison.of_errors("case", drawn(20, 1, 1.1))
    assert found.keys() == {("case", "a")}  # b is best
    one = found["case", "a"]
    assert one.more == pytest.approx(math.log(1.1), abs=0.01)
    assert one.error == pytest.approx(0.05 * math.sqrt(2 / 5 / 20), rel=0.5)
    assert one.probability < 1e-6
    assert one.interval()[0] < 1.1 < one.interval()[1]
    other = comparison.of_errors("case", drawn(20, 1, 1.1), "a")["case", "b"]
    assert (other.more, other.probability) == pytest.approx((-one.more, one.probability))
    assert comparison.of_errors("case", drawn(7, 1, 1.1)) == {}


def test_medians_of_times_are_compared() -> None:
    rng = np.random.default_rng(2)
    times = {"slow": rng.uniform(1.8, 2.2, 20), "fast": np.full(20, 1.0), "alike": rng.uniform(0.9, 1.15, 20)}
    found = comparison.of_times("case", times)
    assert found["case", "slow"].probability < 1e-6
    assert found["case", "alike"].probability > 0.05
    (same,) = comparison.of_times("case", {"a": times["slow"], "b": times["slow"]}).values()
    assert (same.more, same.probability) == (0.0, 1.0)


def test_probabilities_are_corrected_by_holm_over_all_families() -> None:
    """As R's p.adjust: 0.01, 0.02, 0.03, 0.04 become 0.04, 0.06, 0.06, 0.06."""
    families = [against("a", 2.0, 0.03) | against("b", 2.0, 0.01), against("a", 2.0, 0.04) | against("b", 2.0, 0.02)]
    first, second = comparison.corrected(*families)
    assert [one.probability for one in first.values()] == pytest.approx([0.06, 0.04])
    assert [one.probability for one in second.values()] == pytest.approx([0.06, 0.06])
    assert first[CASE, "b"].more == math.log(2.0)


# --- how it is said --------------------------------------------------------------------------------------------------

CASE = "lever_fixed_dither_quiet"


def row(estimator: str, score: float, **more: Any) -> Row:
    five = (score,) * 5
    known: dict[str, Any] = {"ours": estimator in ("dual", "joint"), "asked": 20, "runs": 20, "failures": 0}
    known |= {"rms": five, "score": score, "linearised": tuple(value / 0.1 for value in five)}
    return Row(**{"case": CASE, "estimator": estimator} | known | more)


def against(name: str, more: float, probability: float, case: str = CASE) -> comparison.Differences:
    """Return a difference to the best."""
    return {(case, name): comparison.Difference(math.log(more), 0.02, 20, probability)}


def test_winner_and_who_may_be_as_good() -> None:
    found = against("dual", 1.04, 0.2) | against("rls", 3.0, 1e-6)
    rows = [row("dual", 0.108), row("joint", 0.104), row("rls", 0.3)]
    assert verdicts.verdict(rows, found, {}) == (
        "Smallest errors: joint (1.04 × the Kalman filter linearised at the truth on average); no significant "
        "difference to dual (+4 %)."
    )
    assert verdicts.verdict(rows[1:], found, {}).endswith("; all others are significantly worse.")


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        (0.001, "The firmware is not best: joint has 20 % larger errors (15 to 25 %)."),
        (0.3, "The firmware is not best, but that may be chance: joint has 20 % larger errors (15 to 25 %)."),
    ],
)
def test_says_so_when_ours_is_not_best(probability: float, said: str) -> None:
    found = against("joint", 1.2, probability)
    assert verdicts.verdict([row("joint", 0.12), row("joint_ekf", 0.1)], found, {}).endswith(said)


def test_who_broke_down_is_not_ranked() -> None:
    said = verdicts.verdict([row("joint", 0.12), row("lms", 0.01, failures=2)], {}, {})
    assert said.startswith("Smallest errors: joint")
    assert said.endswith("Diverged, and so not ranked: lms in 2 of 20 runs.")
    assert verdicts.verdict([row("lms", 0.1, failures=20)], {}, {}).startswith("No estimator completed all runs.")
    missing = verdicts.verdict([row("joint", 0.1, runs=19), row("lms", 0.2)], {}, {})
    assert missing.endswith("No estimator of the firmware completed all runs.")


def test_seven_runs_are_too_few() -> None:
    rows = [row("joint", 0.12, asked=7, runs=7), row("lms", 0.3, asked=7, runs=7)]
    assert verdicts.verdict(rows, {}, {}) == "Too few runs for a verdict: 7, at least 8 are needed."


def test_fastest_after_a_step() -> None:
    at = {"case": "step_up", "linearised": (math.nan,) * 5}
    rows = [
        row("dual_shipped", 0.02, ours=True, settled_median=0.4, settled_worst=0.9, **at),
        row("joint_ekf", 0.01, settled_median=1.5, settled_worst=math.inf, **at),
    ]
    errors = against("dual_shipped", 2.0, 1e-9, "step_up")
    fastest = "dual_shipped (median 0.40 s, worst 0.90 s); the fastest baseline, joint_ekf: 1.50 s"
    said = verdicts.verdict(rows, errors, against("joint_ekf", 3.75, 1e-9, "step_up"))
    assert "joint_ekf (baseline) (natural frequency 1 % rms)" in said
    assert said.endswith(f"Fastest after the step: {fastest}.")
    for times in (against("joint_ekf", 3.75, 0.2, "step_up"), {}):
        assert verdicts.verdict(rows, errors, times).endswith(f"{fastest}, which may be chance.")
    never = [dataclasses.replace(each, settled_median=math.inf) for each in rows]
    assert verdicts.verdict(never, errors, {}).endswith("After the step no estimator settles on the natural frequency.")
    rows[0] = dataclasses.replace(rows[0], settled_median=2.0, settled_worst=math.inf)
    other = "joint_ekf (baseline) (median 1.50 s, not in every run); the fastest of the firmware, dual_shipped: 2.00 s"
    assert f"Fastest after the step: {other}" in verdicts.verdict(rows, errors, {})


REQUIRED = {
    "joint: error ÷ Kalman filter linearised at the truth": 1.1,
    "dual: error ÷ Kalman filter linearised at the truth, with dither": 1.3,
    **{
        f"{name}: error ÷ best baseline's, preload {of}": 1.03 for of in ("fixed", "trim") for name in ("dual", "joint")
    },
    "joint: NEES ÷ its 95 % limit": 1.0,
    "joint: NEES ÷ its lower 95 % limit": -1.0,
    "dual: stated σ ÷ rms error": -0.5,
    **{
        f"{name}: {what}": limit
        for name in ("dual", "joint")
        for what, limit in (
            ("step followed in, median [s]", 1.0),
            ("step followed in, worst [s]", 2.0),
            ("the same, 0.1 rad/s/√s, median [s]", 2.0),
            ("steady frequency, rms [%]", 1.5),
            ("the same ÷ without change detection", 1.2),
            ("R, Q wrong by 10: rms ÷ tuned", 1.5),
        )
    },
    "firmware: runs with NaN or a refused factor": 0.0,
}
"""What the firmware must show, as it was asked for: at the most, or below zero, at the least."""


def fives(first: float) -> tuple[float, ...]:
    """Five different numbers, the greatest in the middle."""
    return tuple(first * factor for factor in (0.5, 0.6, 1.0, 0.8, 0.7))


def everything(factor: float = 1.0) -> list[Row]:
    """Return rows with a number of its own for each claim, which are `factor` times these."""
    walk: dict[str, Any] = {"nees": 3.2 * factor, "nees_low": 2.5, "nees_high": 4.0, "ours": True}
    known: dict[str, Any] = {
        "settled_median": 0.9 * factor, "settled_worst": 1.9 * factor, "against": fives(1.3 * factor), "ours": True,
        "rms": fives(0.0125 * factor),
    }  # fmt: skip
    rows = [
        row("joint", 0.1, linearised=fives(1.05 * factor), baseline=fives(1.01 * factor), **walk),
        row("joint", 0.1, case="lever_trim_base_quiet", baseline=fives(1.02 * factor), linearised=fives(9.0)),
        row(
            "dual", 0.1, linearised=fives(1.2 * factor), baseline=fives(0.99 * factor), sigma_ratio=fives(1.1 * factor)
        ),
        row("dual", 0.1, case="lever_fixed_base_quiet", linearised=fives(9.0), sigma_ratio=fives(1.3 * factor)),
        row("dual", 0.1, case="lever_trim_base_quiet", baseline=fives(1.0 * factor), linearised=fives(9.0)),
    ]
    for index, name in enumerate(("dual", "joint")):
        for case, own in (("step_up", 1.0), ("step_up_rough", 2.0), ("step_up_black_box", 9.0)):
            scaled = {
                key: tuple(own * each for each in value) if isinstance(value, tuple) else value * own
                for key, value in known.items()
                if key != "ours"
            }
            rows.append(row(f"{name}_shipped", 0.1 + index, case=case, **(scaled | {"ours": True})))
        rows.append(row(f"{name}_r10_q1", 0.1, case="wrong_noise_fixed", against=fives(1.4 * factor), ours=True))
    return rows


def test_what_has_to_be_shown_is_what_was_asked_for() -> None:
    found = verdicts.claims([])
    assert {claim.text: claim.limit if claim.below else -claim.limit for claim in found} == {
        text: abs(limit) if text.endswith("NaN or a refused factor") else limit for text, limit in REQUIRED.items()
    }
    assert {(claim.kept, claim.kept_in_words) for claim in found} == {(None, "not run")}


def test_each_claim_is_measured_where_it_is_due() -> None:
    found = {claim.text: (claim.measured, claim.where) for claim in verdicts.claims(everything())}
    walk = "lever_trim_base_quiet"
    expected = {
        "joint: error ÷ Kalman filter linearised at the truth": (1.05, f"{CASE}, joint, k_p"),
        "dual: error ÷ Kalman filter linearised at the truth, with dither": (1.2, f"{CASE}, dual, k_p"),
        "joint: error ÷ best baseline's, preload fixed": (1.01, f"{CASE}, joint, k_p"),
        "dual: error ÷ best baseline's, preload fixed": (0.99, f"{CASE}, dual, k_p"),
        "joint: error ÷ best baseline's, preload trim": (1.02, f"{walk}, joint, k_p"),
        "dual: error ÷ best baseline's, preload trim": (1.0, f"{walk}, dual, k_p"),
        "joint: NEES ÷ its 95 % limit": (0.8, f"{CASE}, joint"),
        "joint: NEES ÷ its lower 95 % limit": (1.28, f"{CASE}, joint"),
        "dual: stated σ ÷ rms error": (0.55, f"{CASE}, dual, m_p"),
    }
    for name in ("dual", "joint"):
        expected |= {
            f"{name}: step followed in, median [s]": (0.9, f"step_up, {name}_shipped"),
            f"{name}: step followed in, worst [s]": (1.9, f"step_up, {name}_shipped"),
            f"{name}: the same, 0.1 rad/s/√s, median [s]": (1.8, f"step_up_rough, {name}_shipped"),
            f"{name}: steady frequency, rms [%]": (1.0, f"step_up, {name}_shipped"),
            f"{name}: the same ÷ without change detection": (1.04, f"step_up, {name}_shipped"),
            f"{name}: R, Q wrong by 10: rms ÷ tuned": (1.4, f"wrong_noise_fixed, {name}_r10_q1, k_p"),
        }
    expected["firmware: runs with NaN or a refused factor"] = (0.0, f"{CASE}, joint")
    assert {text: where for text, (_, where) in found.items()} == {text: where for text, (_, where) in expected.items()}
    for text, (value, _) in expected.items():
        assert found[text][0] == pytest.approx(value), text


def test_claims_are_kept_or_not() -> None:
    assert {claim.kept_in_words for claim in verdicts.claims(everything())} == {"yes"}
    worse = {claim.text: claim.kept for claim in verdicts.claims(everything(2.0))}
    at_least = {text for text, limit in REQUIRED.items() if limit < 0.0} | {
        "firmware: runs with NaN or a refused factor"
    }
    assert {text for text, kept in worse.items() if kept} == at_least
    better = {claim.text: claim.kept for claim in verdicts.claims(everything(0.5))}
    assert {text for text, kept in better.items() if not kept} == {
        text for text, limit in REQUIRED.items() if limit < 0
    }
    failed = verdicts.claims([row("joint", 0.1, failures=1)])[-1]
    assert (failed.measured, failed.kept) == (1.0, False)


@pytest.mark.parametrize(("error", "said"), [(0.01, "no"), (0.04, "no"), (0.06, "no, but within chance")])
def test_a_claim_that_chance_may_miss_says_so(error: float, said: str) -> None:
    """Of five values one is 0.1 above the limit: 2.3 standard errors are within chance."""
    errors = (0.01, 0.01, error, 0.01, 0.01)
    first = verdicts.claims([row("joint", 0.1, linearised=(1.0, 1.0, 1.2, 1.0, 1.0), linearised_error=errors)])[0]
    assert (first.measured, first.error, first.kept_in_words) == (1.2, error, said)


def points(data: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the traces of a chart but those that are there for the legend."""
    return [trace for trace in data if not np.isnan(unpack(trace["x"])).all()]


def test_claims_stand_in_table_and_page() -> None:
    rows = everything(1.5)
    claims = verdicts.claims(rows)
    *_, last = table.tables(rows, claims).items()
    assert last[0] == "claims about the firmware"
    first = {"claim": claims[0].text, "limit": "≤ 1.1", "measured": 1.58, "±": None, "kept": "no"}
    assert last[1][0] == first | {"worst in": claims[0].where}
    assert [line["limit"] for line in last[1] if "lower" in str(line["claim"])] == ["≥ 1"]
    page, _ = compare_page.build(Results(Plan(20), {}, {}), rows, {}, claims, {})
    kept = sum(claim.kept is True for claim in claims)
    assert f'<p class="verdict bad">{kept} of {len(claims)} claims about the firmware hold.' in page
    cells = ("<strong>no</strong>", "1.58", "≤ 1.1", claims[0].where)
    assert "".join(f"<td>{cell}</td>" for cell in cells) in page.replace(' class="num"', "")
    shown = figures(Reader(page))["noise-wrong_noise_fixed"]
    marks = points(shown["data"])
    assert [trace["name"] for trace in marks] == ["m_p", "c_p", "k_p", "natural_frequency", "damping_ratio"]
    np.testing.assert_allclose([unpack(trace["x"])[0] for trace in marks], fives(1.4 * 1.5))
    assert not any("error_x" in trace for trace in shown["data"])
    assert [shape["x0"] for shape in shown["layout"]["shapes"]] == [1.0, 1.5]


def test_a_line_of_the_table_has_every_figure_in_its_unit() -> None:
    own = {"rms": (0.01, 0.02, 0.03, 0.004, 0.05), "linearised": (1.0, 1.1, 1.2, 1.3, 1.4)}
    ends: dict[str, Any] = {
        "bound": (2.0, 2.1, 2.2, 2.3, 2.4),
        "against": (0.5, 0.6, 0.7, 0.8, 0.9),
        "nees_low": 2.5,
        "nees_high": 3.5,
    }
    ((line,),) = table.tables(
        [row("joint", 0.1, **own, **ends, linearised_error=(0.1, 0.5, 0.2, 0.0, 0.0))], []
    ).values()
    names = ("m_p", "c_p", "k_p", "natural_frequency", "damping_ratio")
    expected = {f"{name} rms [%]": 100.0 * value for name, value in zip(names, own["rms"], strict=True)}
    for title, values in (
        ("linearised", own["linearised"]),
        ("Cramér-Rao", ends["bound"]),
        ("reference", ends["against"]),
    ):
        expected |= {f"{name} ÷ {title}": value for name, value in zip(names, values, strict=True)}
    assert {key: line[key] for key in expected} == pytest.approx(expected)
    assert (line["± of these"], line["95 % band"]) == (0.5, "2.50-3.50")


def test_a_chart_shows_each_estimator_in_each_case_with_its_standard_error() -> None:
    own = {"linearised": (2.0, 8.0, math.nan, 4.0, 4.0), "linearised_error": (0.1,) * 5, "bound": (3.0,) * 5}
    rows = [row("joint", 0.1, nees=3.2, nees_low=2.5, nees_high=3.5, **own), row("rls", 0.2, linearised=fives(1.0))]
    rows.append(row("joint", 0.1, case="lever_fixed_base_quiet", linearised=fives(2.0)))
    rows.append(row("joint", 0.1, case="lever_trim_base_quiet", linearised=fives(3.0)))
    shown = charts.linearised(rows, "lever", "fixed")
    assert shown is not None
    first, second = points(shown.spec()["data"])
    assert (first["name"], second["name"]) == (CASE, "lever_fixed_base_quiet")
    np.testing.assert_allclose(unpack(first["x"]), np.array((4.0, math.prod(fives(1.0)) ** 0.2)))
    np.testing.assert_allclose(unpack(first["y"]), [-0.15, 0.85])
    np.testing.assert_allclose(unpack(second["y"]), [0.15])
    assert first["error_x"]["array"] == pytest.approx([0.1, 0.0])
    for chart, value, marks in (
        (charts.bound, 3.0, [1.0]),
        (lambda rows, model, _: charts.nees(rows, model), 3.2, [3.0, 2.5, 3.5]),
    ):
        shown = chart(rows, "lever", "fixed")
        assert shown is not None
        (only,) = points(shown.spec()["data"])
        np.testing.assert_allclose(unpack(only["x"]), [value], rtol=1e-6)
        assert [shape["x0"] for shape in shown.shapes] == marks
    assert charts.bound(rows, "linear_physical", "fixed") is None


def test_an_estimator_has_one_colour_in_all_its_settings_and_cases() -> None:
    names = ("dual", "dual_shipped", "joint", "joint_ekf", "rls")
    rows = [row(name, 0.1, linearised=fives(1.0), bound=fives(1.0)) for name in names]
    rows += [row(name, 0.1, case="lever_fixed_base_quiet", linearised=fives(1.0)) for name in names]
    shown = [charts.linearised(rows, "lever", "fixed"), charts.bound(rows, "lever", "fixed")]
    colours = {tuple(trace["marker"]["color"]) for figure in shown if figure for trace in points(figure.spec()["data"])}
    ((first, second, *others),) = colours
    assert first == second
    assert len({first, *others}) == 4


def test_csv_has_every_figure_with_all_digits() -> None:
    rows = [row("joint", 1.0 / 3.0, nees=3.1), row("joint_ekf", 0.1, failures=1)]
    lines = list(csv.DictReader(io.StringIO(table.csv_text(rows))))
    assert list(lines[0]) == table.columns()
    for line, original in zip(lines, rows, strict=True):
        assert (line["case"], line["estimator"]) == (original.case, original.estimator)
        for field in dataclasses.fields(Row):
            value = getattr(original, field.name)
            parts = [cell for name, cell in line.items() if name.startswith(f"{field.name}_") and field.name == "rms"]
            if field.name == "rms":
                assert tuple(map(float, parts)) == value
            elif isinstance(value, float) and not math.isnan(value):
                assert float(line[field.name]) == value
    assert lines[0]["model"] == "lever"
    assert lines[0]["parameters"] == "m_p c_p k_p"


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenarios", "step_upp"), "no scenario 'step_upp'; did you mean step_up?"),
        (("--estimators", "kalman"), "no estimator 'kalman'"),
        (("--models", "quadratic"), "no model 'quadratic'"),
        (("--seeds", "0"), "--seeds 0: must be at least 1"),
        (("--seed", "-1"), "argument --seed: -1 is not from 0 to "),
        (("--jobs", "0"), "--jobs 0: must be at least 1"),
        (("--duration", "0.1"), "--duration 0.1: must be from 1 to 3600 s"),
        (("--scenarios", "steady", "--estimators", "dual_r10_q10"), "none of these estimators takes part"),
    ],
)
def test_what_is_wrong_is_one_line(arguments: tuple[str, ...], said: str, refused: Refused) -> None:
    assert said in refused("compare", *arguments)


def test_list(lever: Run) -> None:
    out = lever("compare", "--list")[1]
    assert all(name in out for name in (*cases(), *BASELINES))


def test_who_is_left_out_is_named_and_what_is_not_drawn_is_not(lever: Run, tmp_path: Path) -> None:
    chosen = ("--scenarios", "steady", "--estimators", "dual", "rls", "--seeds", "1", "--duration", "1", "--jobs", "1")
    status, said, err = lever("compare", *chosen, "--out", tmp_path)
    assert status == 0
    assert "lever: warning: not run, as none of these cases has it: dual; see `lever compare --list`\n" in err
    made = "compare.html, compare.csv, provenance.json"
    assert said.endswith(f"Written to {tmp_path}: {made}\n")
    assert {path.name for path in tmp_path.iterdir()} == set(made.split(", "))


def test_a_small_campaign(lever: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two cases in two processes; the same figures as in one process."""
    chosen = ("--scenarios", "lever_fixed_dither_rough", "step_up", "--estimators", "joint", "dual_shipped", "rls")
    brief = ("--seeds", "2", "--duration", "3")
    out, tables = tmp_path / "deep" / "out", tmp_path / "tables.json"
    status, said, _ = lever("compare", *chosen, *brief, "--jobs", "2", "--out", out, "--json", tables)
    assert status == 0
    assert "lever_fixed_dither_rough: Too few runs for a verdict: 2" in said
    drawn = figures(Reader((out / "compare.html").read_text()))
    pictures = [f"{name}.{kind}" for name in drawn for kind in ("pdf", "svg", "csv")]
    assert {path.name for path in out.iterdir()} == {"compare.csv", "compare.html", "provenance.json", *pictures}
    named = f"compare.html, compare.csv, {len(drawn)} figures as .pdf, .svg, .csv, provenance.json"
    assert said.endswith(f"Written to {out}: {named}\n")
    lines = list(csv.DictReader(io.StringIO((out / "compare.csv").read_text())))
    assert len(lines) == 5
    walk = next(line for line in lines if line["case"].startswith("lever") and line["estimator"] == "joint")
    assert 0.1 < float(walk["linearised_natural_frequency"]) < 10.0
    page = (out / "compare.html").read_text()
    drawn = figures(Reader(page))
    assert {"linearised-lever", "bound-lever", "settling-step_up", "following-step_up"} <= drawn.keys()
    assert all(f'id="{key}"' in page for key in drawn)
    assert len(json.loads(tables.read_text())) == 3  # and provenance
    monkeypatch.setattr(interrupts, "worker_pool", None)  # not called for one process
    alone = run_cases.run(run_cases.tasks(["lever_fixed_dither_rough"], ["joint"], Plan(2, 3.0)), 1)
    (row,) = evaluation.judge(alone)
    assert float(walk["linearised_natural_frequency"]) == row.linearised[3]


def test_a_logarithmic_axis_is_one_in_print() -> None:
    figure = drawing.Figure([drawing.axis("y")], drawing.axis("x", type="log"), 200, over_time=False)
    figure.add(drawing.line(np.array([0.1, 1.0, 10.0]), np.ones(3), "name", "estimate"))
    (axes,) = sheet_of([("", figure.spec())], 3.0, "double").axes
    assert axes.get_xscale() == "log"


def test_a_figure_for_print_is_what_the_page_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lanes of two estimators, of which one has no error, and a band about a curve; each is laid out once."""
    lanes: dict[str, Any] = {"tickvals": [0, 1], "ticktext": ["joint", "rls"], "range": [1.5, -0.5]}
    figure = drawing.Figure([lanes], drawing.axis("error", type="log"), 200, over_time=False)
    marker = {"color": ["@estimate", "@joint"], "size": 8, "symbol": "square"}
    errors = {"type": "data", "array": [0.25, 0.0], "color": "@mark"}
    figure.add(drawing.dots(np.array([1.5, 2.5]), np.array([0.0, 1.0]), "rough", "text", marker=marker, error_x=errors))
    assert list(csv.reader(io.StringIO(printed.table(figure.spec())))) == [
        list(printed.COLUMNS), ["rough", "joint", "1.5", "0", "0.25"], ["rough", "rls", "2.5", "1", ""]
    ]  # fmt: skip
    x = np.linspace(0.0, 1.0, 50)
    curve = drawing.Figure([drawing.axis("y", range=[0, 10])], drawing.axis("time [s]"), 380, over_time=False)
    curve.add(*drawing.band(x, 2.0 + x, 4.0 + x, "middle half", "estimate-band"))
    curve.add(drawing.line(x, 3.0 + x, "median", "estimate"))
    curve.level(5.0)
    laid_out = []

    def lay_out(*what: Any) -> Any:
        laid_out.append(what)
        return sheet_of(*what)

    monkeypatch.setattr(printed, "charts", lay_out)
    written = dict(printed.files({"figure": figure.spec(), "curve": curve.spec()}, provenance()))
    assert len(laid_out) == 2
    for name, shown in (("figure", figure), ("curve", curve)):
        svg = written[f"{name}.svg"].decode()
        width = re.search(r'width="([\d.]+)pt"', svg)
        assert width is not None
        assert float(width[1]) == pytest.approx(180 / 25.4 * 72, abs=0.1)
        words = "".join(ElementTree.fromstring(svg).itertext())
        assert all(name in words for name in (("joint", "rls", "error") if shown is figure else ("median", "time [s]")))
        assert written[f"{name}.pdf"].startswith(b"%PDF")
