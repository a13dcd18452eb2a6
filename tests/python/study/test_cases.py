"""Which cases there are to compare estimators on, and who takes part in each with which settings."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_sil.scenarios import scenario
from lever_sil.study.baselines import BASELINES
from lever_sil.study.baselines.algorithm1 import Algorithm1
from lever_sil.study.baselines.lms import Nlms
from lever_sil.study.baselines.rls import Rls
from lever_sil.study.compare.cases import Case, Paper, Plan, Protocol, Recorded, Stepped, cases
from lever_sil.study.compare.entrants import Entrant, entrants
from lever_sil.study.steps import Step

DEFAULTS = Config().settings
PRIOR: dict[str, dict[str, float]] = {
    "lever": {"m_p_sigma": 0.25, "c_p_sigma": 0.3, "k_p_sigma": 0.3},
    "linear_physical": {"m_sigma": 0.25, "c_sigma": 0.3, "k_sigma": 0.3},
    "linear_black_box": {},
}
"""A first guess that is wrong by a quarter to a third."""


def of_kind(kind: str) -> dict[str, Case]:
    return {name: case for name, case in cases().items() if case.kind == kind}


def test_there_are_as_many_cases_as_combinations() -> None:
    """Of model, truth and noise; and every scenario that an estimator of two outputs can be run on."""
    counts = {
        kind: len(of_kind(kind)) for kind in ("matched", "step", "wrong noise", "wrong tuning", "paper", "protocol")
    }
    assert counts == {
        "matched": 2 * 2 * (2 + 2 + 1), "step": 6, "wrong noise": 2, "wrong tuning": 2, "paper": 3 * 3 * 2 * 2,
        "protocol": 3 * 3 + 1,
    }  # fmt: skip
    assert of_kind("scenario").keys() <= set(scenario.names())
    assert all(case.name == name for name, case in cases().items())


def test_the_experiment_of_the_paper_is_as_its_cases_are_called() -> None:
    for name, case in of_kind("paper").items():
        assert isinstance(case, Paper)
        _, model, truth, outputs, level = re.split(r"_(?!physical|black|box)", name)
        factor, noise = {"fine": 1.0, "coarse": 5.0}[outputs], {"quiet": 0.01, "rough": 0.1}[level]
        assert (case.model, case.truth, case.preload) == (model, truth, "trim")
        assert (case.duration, case.every, case.own_settings) == (40.0, 0.05, PRIOR[model])
        assert case.noise == {
            "theta_noise": factor * DEFAULTS["theta_noise"],
            "theta_dot_noise": factor * DEFAULTS["theta_dot_noise"],
            "theta_dot_process_noise": noise,
        }
        assert case.change(Plan()) == (20.0 if truth == "jump" else None)
        assert f"measurement noise × {factor:g}, process noise {noise:g} rad/s/√s" in case.title
    jumping = cases()["paper_lever_jump_fine_quiet"]
    time = np.arange(0.5, 40.0, 1.0)
    expected = [10.5 + i for i in range(10)] + [25.5 + i for i in range(15)]
    assert time[jumping.judged(time, Plan())].tolist() == expected
    assert time[cases()["paper_lever_drift_fine_quiet"].judged(time, Plan())].tolist() == [10.5 + i for i in range(30)]
    half = Plan(duration=20.0)
    assert jumping.change(half) == 10.0
    assert time[jumping.judged(time, half) & (time < 20.0)].tolist() == [5.5 + i for i in range(5)] + [
        12.5 + i for i in range(8)
    ]


def test_the_protocols_of_others_are_as_their_cases_are_called() -> None:
    for name, case in of_kind("protocol").items():
        assert isinstance(case, Protocol)
        truth, noise = (
            ("square wave", 0.05) if name == "square_wave" else (name.split("_")[1], float(name.split("_")[2]))
        )
        assert (case.truth, case.process_noise, case.model, case.duration) == (truth, noise, "lever", 40.0)
        assert case.noise["theta_noise"] == DEFAULTS["theta_noise"]
        assert f"remnant {noise:g} rad/s/√s" in case.title
    square = cases()["square_wave"]
    assert isinstance(square, Protocol)
    assert "k_p × 1.3 and back" in square.title
    time = np.arange(0.5, 40.0, 1.0)
    high = time[square.high(time, Plan())].tolist()
    assert high == [start + 0.5 + i for start in (10.0, 20.0, 30.0) for i in range(5)]
    assert square.high(np.array([4.9, 5.0, 7.4, 7.5]), Plan(duration=20.0)).tolist() == [False, True, True, False]


def test_scenarios_are_as_they_ship() -> None:
    for name, case in of_kind("scenario").items():
        assert isinstance(case, Recorded)
        shipped = scenario.load(name)
        assert case.noise == {}
        assert case.own_settings == (shipped.settings or {})
        choices = shipped.config.choices
        assert (case.model, case.preload, case.duration) == (choices["model"], choices["preload"], shipped.duration)
        assert case.every == 0.02
        assert shipped.title in case.title
        assert (case.runs(Plan(19)), case.runs(Plan(21))) == (19, 20)


def test_a_step_is_of_the_arm_by_a_third_in_usual_vibration() -> None:
    step = Step()
    assert (step.factor, step.at, step.duration, step.process_noise) == (1.3, 25.0, 45.0, 0.05)
    assert step.base_rms == pytest.approx(0.980665)
    assert (step.dither_rms, step.band, step.trim, step.spread) == (0.3, (1.0, 10.0), math.radians(20.0), 0.25)
    for name, case in of_kind("step").items():
        assert isinstance(case, Stepped)
        assert case.model == ("linear_black_box" if name.endswith("black_box") else "lever")
        assert f"k_p and c_p × {case.step.factor:g}, seen by {case.model}" in case.title
        assert f"process noise {case.step.process_noise:g} rad/s/√s" in case.title


def test_titles_of_walks_say_what_shakes_them() -> None:
    for name, case in of_kind("matched").items():
        noise = 0.1 if name.endswith("rough") else 0.01
        shaken = "base and 0.3 N m dither" if "_dither_" in name else "base only"
        assert case.title == (
            f"matched walk, {case.model}, preload {case.preload}, {shaken}, process noise {noise:g} rad/s/√s"
        )
        assert case.own_settings == PRIOR[case.model]


def test_a_plan_is_whole_with_twenty_seeds_and_the_durations_of_the_cases() -> None:
    assert Plan().seeds == 40
    assert [Plan(seeds).is_whole for seeds in (19, 20, 40)] == [False, True, True]
    assert not Plan(40, 60.0).is_whole
    case = cases()["steady"]
    assert (case.length(Plan()), case.length(Plan(duration=9.0)), case.runs(Plan(3))) == (60.0, 9.0, 3)
    assert case.scaled(15.0, Plan(duration=30.0)) == 7.5


# --- who takes part --------------------------------------------------------------------------------------------------

OURS = ("dual", "joint")
TOLD, SHIPPED = set(OURS), {f"{name}_shipped" for name in OURS}
NO_CHANGE = {f"{name}_no_change" for name in OURS}
PUBLISHED = set(BASELINES)
OF_THE_PAPER = {"algorithm1", "dual_ekf", "rls", "lms"}
TAKING_PART = {
    "lever_fixed_dither_quiet": TOLD | SHIPPED | PUBLISHED,
    "step_up": SHIPPED | NO_CHANGE | PUBLISHED,
    "steady": SHIPPED | NO_CHANGE | PUBLISHED,
    "wrong_noise_trim": TOLD | {f"{name}_r{r}_q{q}" for name in OURS for r in (0.1, 1, 10) for q in (0.1, 1, 10)},
    "paper_lever_drift_fine_quiet": {"dual_shipped", *OF_THE_PAPER}
    | {f"{name}_{kind}" for name in OURS for kind in ("fixed", "annealing", "robbins_monro")},
    "square_wave": {"dual_shipped", *(name for name in PUBLISHED if not name.startswith("algorithm1"))},
}


@pytest.mark.parametrize("name", TAKING_PART)
def test_those_take_part_that_are_meant_to(name: str) -> None:
    found = entrants(cases()[name])
    assert found.keys() == TAKING_PART[name]
    assert [each for each, entrant in found.items() if entrant.ours] == [
        each for each in found if each not in PUBLISHED
    ]
    assert all(entrant.name == each for each, entrant in found.items())


def made(case: str, name: str) -> tuple[Any, Entrant]:
    entrant = entrants(cases()[case])[name]
    firmware: Any = entrant.make(cases()[case])
    return firmware, entrant


STILL = {"change_threshold": 0.0, "noise_window": 0.0}


@pytest.mark.parametrize(
    ("case", "name", "adaptation", "settings", "reference", "title"),
    [
        (
            "lever_fixed_dither_rough", "dual", "fixed",
            PRIOR["lever"] | STILL | {"theta_dot_process_noise": 0.1, "align_time": 0.0}, "", "dual, told the noise",
        ),
        (
            "lever_trim_base_quiet", "joint", "fixed",
            PRIOR["lever"] | STILL | {"theta_dot_process_noise": 0.01}, "", "joint, told the noise",
        ),
        ("step_up", "dual_shipped", "robbins_monro", {}, "dual_no_change", "dual, as shipped"),
        ("step_up", "joint_no_change", "robbins_monro", {"change_threshold": 0.0}, "", "without change detection"),
        (
            "wrong_noise_trim", "joint_r10_q0.1", "robbins_monro",
            PRIOR["lever"] | {name: 10.0 * DEFAULTS[name] for name in ("theta_noise", "theta_dot_noise")}
            | {"theta_dot_process_noise": 0.1 * DEFAULTS["theta_dot_process_noise"]},
            "joint", "as shipped, R × 10, Q × 0.1",
        ),
        (
            "paper_lever_drift_coarse_rough", "dual_annealing", "annealing",
            {**PRIOR["lever"], **STILL, **cases()["paper_lever_drift_coarse_rough"].noise}, "",
            "told the noise, annealed walk",
        ),
        (
            "paper_lever_drift_coarse_rough", "joint_robbins_monro", "robbins_monro",
            {**PRIOR["lever"], **STILL, **cases()["paper_lever_drift_coarse_rough"].noise}, "",
            "told the noise, walk by Robbins-Monro",
        ),
        ("paper_lever_drift_coarse_rough", "dual_shipped", "robbins_monro", PRIOR["lever"], "", "dual, as shipped"),
        (
            "wrong_tuning_trim", "dual_r0.1_q10", "robbins_monro",
            PRIOR["lever"] | {name: 0.1 * DEFAULTS[name] for name in ("theta_noise", "theta_dot_noise")}
            | {"theta_dot_process_noise": 10.0 * DEFAULTS["theta_dot_process_noise"]},
            "dual", "as shipped, r × 0.1, q × 10",
        ),
    ],
)  # fmt: skip
def test_the_firmware_is_set_up_as_its_name_says(
    case: str, name: str, adaptation: str, settings: Mapping[str, float], reference: str, title: str
) -> None:
    firmware, entrant = made(case, name)
    assert (firmware.model, firmware.preload) == (cases()[case].model, cases()[case].preload)
    assert (firmware.estimator, firmware.adaptation) == (name.split("_")[0], adaptation)
    assert firmware.settings == pytest.approx(settings)
    assert entrant.reference == reference
    assert entrant.ours
    assert entrant.title.endswith(title)


def test_published_ones_are_those_of_their_source() -> None:
    for name, entrant in entrants(cases()["steady"]).items():
        if name in BASELINES:
            baseline = BASELINES[name]
            assert entrant.title == f"{baseline.title} ({baseline.source})"
            assert entrant.make(cases()["steady"]) is baseline.run
            assert (entrant.ours, entrant.reference) == (False, "")


def test_published_ones_are_as_they_were_tuned() -> None:
    """RLS and LMS by windows of 20 ms above 1 Hz, RLS with a memory of 8 s, LMS with a step of 0.1; 30 ms ahead."""
    assert BASELINES["rls"].run == Rls(window=0.02, forgetting=8.0, corner=1.0, regularised=False)
    assert BASELINES["rls_regularised"].run == Rls(window=0.02, forgetting=8.0, corner=1.0, regularised=True)
    assert BASELINES["lms"].run == Nlms(window=0.02, step=0.1, corner=1.0)
    assert BASELINES["algorithm1"].run == Algorithm1(ahead=0.0)
    assert BASELINES["algorithm1_ahead"].run == Algorithm1(ahead=0.03)
    assert BASELINES.keys() == {
        *("algorithm1", "algorithm1_ahead", "dual_ekf", "joint_ekf", "joint_ukf", "rls", "rls_regularised", "lms"),
    }
