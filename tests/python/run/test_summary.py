"""The summary against closed forms on a trace that is made up."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf import load_scenario, simulate
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.native import enum_names
from lever_cdkf.firmware.quantities import quantities
from lever_cdkf.results import whiteness
from lever_cdkf.results.summary import Firmware, SimulationSummary, Stability, of, read, text
from lever_cdkf.results.trace import Trace
from lever_cdkf.results.whiteness import Whiteness
from lever_sil.run import loop, summary
from lever_sil.scenarios import inputs
from lever_sil.scenarios.scenario import Scenario
from scipy import stats

COUNT = 10_000
TIME = np.arange(COUNT, dtype=np.float64) * 1e-3
TEXT = """
title = "t"
duration = "10 s"
converged_after = "2 s"
[pilot]
trim = "20 deg"
m_p = "2 kg"
c_p = { kind = "steps", first = "50 N s/m", at = ["4 s"], to = ["40 N s/m"] }
k_p = "2000 N/m"
[limits]
m_p = "5 %"
natural_frequency = "2 %"
coverage = "90 %"
"""


@pytest.fixture
def recording(load: Callable[..., Scenario]) -> loop.Recording:
    scenario = load(TEXT)
    return loop.Recording(scenario, inputs.prepare(scenario))


def perfect(recording: loop.Recording) -> Trace:
    """Return a trace in which every estimate is the truth, with 1 % of sigma."""
    random = np.random.default_rng(0)
    dynamics = {"natural_frequency": np.full(COUNT, 3.5), "damping_ratio": np.full(COUNT, 0.3)}
    values = {**recording.inputs.truth.parameters, **dynamics}
    trace: Trace = {"time_s": TIME, "theta_measured_rad": np.zeros(COUNT), "theta_dot_measured_rad_s": np.zeros(COUNT)}
    for quantity in quantities("lever"):
        trace[quantity.column("true")] = values[quantity.key]
        trace[quantity.column("estimate")] = values[quantity.key].copy()
        trace[quantity.column("sigma")] = 0.01 * values[quantity.key]
    trace["nis"] = random.chisquare(2, COUNT)
    trace["mode"] = np.where(TIME < 0.1, 1.0, 2.0)
    return trace | {name: np.zeros(COUNT) for name in ("faults", "lost", "corrupt", "late", "restarts")}


def test_a_perfect_estimate_is_perfect(recording: loop.Recording) -> None:
    summarised = summary.build(recording, perfect(recording))
    for entry in summarised.parameters.values():
        assert (entry.rms_percent, entry.bias_percent, entry.coverage_2sigma) == (0.0, 0.0, 1.0)
        assert entry.time_to_10_percent_s == entry.time_to_5_percent_s == [0.0, 0.0]
    assert summarised.passed
    assert summarised.verdict.startswith("All limits kept. Rms errors after convergence: m_p 0.0 %")
    assert "In this run ±2σ covers every truth for at least 100 % of the time." in summarised.verdict
    assert summarised.modes_s == {"align": 0.1, "run": 9.9}
    assert summarised.scenario.changes_s == [0.0, 4.0]


def test_errors_are_relative_and_judged_after_convergence_only(recording: loop.Recording) -> None:
    trace = perfect(recording)
    judged = ((TIME >= 2) & (TIME < 4)) | (TIME >= 6)
    trace["m_p_estimate_kg"] = np.where(judged, np.where(np.arange(COUNT) % 2, 2.0 * 1.07, 2.0 * 0.97), 7.0)
    summarised = summary.build(recording, trace)
    entry = summarised.parameters["m_p"]
    assert entry.rms_percent == pytest.approx(math.sqrt((49 + 9) / 2))
    assert entry.bias_percent == pytest.approx(2.0)
    assert entry.coverage_2sigma == 0.0
    assert not summarised.passed
    assert summarised.missed == ["rms error of m_p 5.4 % (limit 5 %)", "coverage of m_p 0 % (limit 90 %)"]
    assert "Limits missed: rms error of m_p 5.4 % (limit 5 %)" in summarised.verdict
    assert "In this run the stated σ of m_p is too small" in summarised.verdict


@pytest.mark.parametrize(
    ("outside", "said"),
    [
        (600, "In this run ±2σ covers every truth for at least 90 % of the time."),
        (601, "In this run the stated σ of m_p is too small: ±2σ covers the truth for 89.9 % of the time."),
    ],
)
def test_sigma_is_too_small_where_it_covers_less_than_90_percent(
    recording: loop.Recording, outside: int, said: str
) -> None:
    """6,000 samples are judged: those from 2 s after the start and after the jump at 4 s on."""
    trace = perfect(recording)
    trace["m_p_estimate_kg"][-outside:] *= 1.0201  # of 2.0 % of sigma
    trace["m_p_estimate_kg"][6000:-outside] *= 1.0199
    summed = summary.build(recording, trace)
    assert summed.parameters["m_p"].coverage_2sigma == pytest.approx(1.0 - outside / 6000)
    assert said in summed.verdict
    assert summed.missed == ([] if outside == 600 else ["coverage of m_p 89.9 % (limit 90 %)"])


@pytest.mark.parametrize(("factor", "kept"), [(1.0499, True), (1.0501, False)])
def test_a_limit_is_missed_by_more_than_it_says(recording: loop.Recording, factor: float, kept: bool) -> None:
    trace = perfect(recording)
    trace["m_p_estimate_kg"] *= factor
    trace["m_p_sigma_kg"] *= 10.0
    assert summary.build(recording, trace).passed is kept


def test_times_run_from_each_change_until_inside_for_good() -> None:
    relative = 0.5 * np.exp(-TIME / 0.5)
    relative[TIME >= 4.0] = -0.3 * np.exp(-(TIME[TIME >= 4.0] - 4.0) / 1.0)
    changes = (0.0, 4.0)
    times = summary.times_to(relative, TIME, changes, 0.1)
    assert times == pytest.approx([0.5 * math.log(5), math.log(3)], abs=1.1e-3)
    relative[2500] = 0.2
    assert summary.times_to(relative, TIME, changes, 0.1)[0] == pytest.approx(2.501)
    relative[3999] = math.nan
    assert summary.times_to(relative, TIME, changes, 0.1)[0] is None
    assert summary.times_to(np.zeros(COUNT), TIME, changes, 0.1) == [0.0, 0.0]


def test_nis_of_chi_square_is_inside_its_bands(recording: loop.Recording) -> None:
    trace = perfect(recording)
    nis = summary.build(recording, trace).nis
    assert nis.mean is not None
    assert nis.mean_band_95 is not None
    assert nis.expected == 2.0
    assert nis.mean_band_95[0] < nis.mean < nis.mean_band_95[1]
    assert nis.inside_95_percent == pytest.approx(0.95, abs=0.01)
    width = nis.mean_band_95[1] - nis.mean_band_95[0]
    exact = np.diff(stats.chi2.ppf((0.025, 0.975), 2 * 6000)) / 6000
    assert width == pytest.approx(exact[0], rel=0.01)


def test_nis_expects_as_many_degrees_of_freedom_as_outputs(recording: loop.Recording) -> None:
    trace = perfect(recording)
    half = np.arange(COUNT) % 2 == 0
    trace["theta_measured_rad"][half] = math.nan
    trace["nis"][half] = np.random.default_rng(2).chisquare(1, half.sum())
    trace["theta_dot_measured_rad_s"][::4] = math.nan  # both missing: not counted
    trace["nis"][::4] = 0.0
    nis = summary.build(recording, trace).nis
    assert nis.expected == pytest.approx((1 + 2 + 2) / 3, abs=1e-3)
    assert nis.mean == pytest.approx(nis.expected, rel=0.05)
    assert nis.inside_95_percent == pytest.approx(0.95, abs=0.01)


def test_faults_and_missing_answers_fail_a_run(recording: loop.Recording) -> None:
    trace = perfect(recording)
    recording.unanswered = 3
    summarised = summary.build(recording, trace)
    assert not summarised.passed
    assert summarised.verdict.startswith("Trouble: 3 samples got no answer.")
    recording.unanswered, recording.misplaced = 0, 2
    summarised = summary.build(recording, trace)
    assert not summarised.passed
    assert summarised.verdict.startswith("Trouble: 2 estimates belong to other samples.")
    recording.misplaced = 0
    trace["mode"][5000:5100] = 5.0
    summarised = summary.build(recording, trace)
    assert not summarised.passed
    assert "the estimator was in fault for 0.1 s" in summarised.verdict


def test_faults_are_shares_of_the_judged_time(recording: loop.Recording) -> None:
    """6 s of 10 are judged: those from 2 s after the start and after the jump at 4 s on."""
    bits = {name: bit for bit, name in enum_names("lever_fault").items()}
    trace = perfect(recording)
    trace["faults"][:2500] = bits["mismatch"] + bits["change"]  # half a second of it judged
    trace["faults"][7000:8000] = bits["bound"]
    trace["faults"][8000:8500] = bits["excitation"]
    trace["faults"][9400:] = np.nan  # HEALTH has not told
    summarised = summary.build(recording, trace)
    expected = {"bound": 1.0, "change": 0.5, "mismatch": 0.5, "excitation": 0.5}
    assert summarised.fault_shares == pytest.approx({name: seconds / 5.4 for name, seconds in expected.items()})
    assert summarised.flagged_share == pytest.approx(1.5 / 5.4)
    trace["faults"][:] = np.nan
    summarised = summary.build(recording, trace)
    assert (summarised.fault_shares, summarised.flagged_share) == ({}, None)


def test_whether_the_estimator_has_the_settings_of_the_scenario_is_told(recording: loop.Recording) -> None:
    unknown = "The estimator has not sent its settings (IDENTITY): those of the scenario are assumed."
    summarised = summary.build(recording, perfect(recording))
    assert summarised.firmware == Firmware(None, None, None)
    assert summarised.verdict.endswith(unknown)
    pages = {"firmware_major": 0.0, "firmware_minor": 2.0, "firmware_patch": 0.0, "contract": 2.0}
    recording.identity.take(pages | {"settings_crc": float(recording.scenario.config.settings_crc)})
    summarised = summary.build(recording, perfect(recording))
    assert summarised.firmware == Firmware("0.2.0", 2, True)
    assert unknown not in summarised.verdict


def test_a_run_too_short_to_judge_says_so_and_is_valid_json(load: Callable[..., Scenario]) -> None:
    scenario = load(TEXT, "converged_after=20 s")
    recording = loop.Recording(scenario, inputs.prepare(scenario))
    trace = perfect(recording)
    trace["m_p_estimate_kg"][:] = math.nan
    summarised = summary.build(recording, trace)
    assert summarised.passed
    assert summarised.verdict.startswith("Too short to judge")
    content = json.loads(text(summarised.timed(0.5)))
    assert content["parameters"]["m_p"]["rms_percent"] is None
    assert content["parameters"]["m_p"]["time_to_10_percent_s"] == [None, None]
    assert content["wall_time_per_simulated_time"] == pytest.approx(0.05)


def test_of_a_pilot_of_another_model_only_the_dynamics_are_judged(load: Callable[..., Scenario]) -> None:
    scenario = load(TEXT, "estimator.model=linear_physical", "limits={natural_frequency='2 %', coverage='90 %'}")
    recording = loop.Recording(scenario, inputs.prepare(scenario))
    trace = perfect(recording)
    trace["damping_ratio_sigma"][:] = 0.0
    trace["damping_ratio_estimate"] *= 1.01
    summarised = summary.build(recording, trace)
    assert list(summarised.parameters) == ["natural_frequency", "damping_ratio"]
    assert summarised.missed == ["coverage of damping_ratio 0 % (limit 90 %)"]
    assert "m_p" not in summarised.verdict


def test_the_transfer_function_of_another_models_truth_is_told_where_it_changes(load: Callable[..., Scenario]) -> None:
    """The pilot tightens his c_p at 4 s; against M, D, K and the forcing of firmware/THEORY.md worked out here."""
    scenario = load(TEXT, "estimator.model=linear_physical", "limits={}")
    recording = loop.Recording(scenario, inputs.prepare(scenario))
    transfers = summary.build(recording, perfect(recording)).truth
    assert transfers.model == "lever"
    assert transfers.transfer is not None
    assert transfers.transfer.time_s == [0.0, pytest.approx(4.0, abs=10.0 / summary.MOST_TRANSFERS)]
    cosine, arm = math.cos(math.radians(20.0)), 0.45**2
    for c_p, numerator, denominator in zip(
        (50.0, 40.0), transfers.transfer.numerator, transfers.transfer.denominator, strict=True
    ):
        assert numerator == pytest.approx([-0.45 * (0.6 + 2.0) * cosine])
        expected = [arm * (0.3 + 2.0) + 0.02, arm * c_p * cosine**2 + 0.5, arm * 2000.0 * cosine**2 + 5.0]
        assert denominator == pytest.approx(expected)


def test_white_residuals_are_no_proof_of_the_model() -> None:
    white = Whiteness(0.02, [0.0] * 25, band_95=0.04, largest=0.05, largest_after_s=0.06, white=True)
    said = whiteness.verdict(white)
    assert said.startswith("Residuals of the rate are white up to a lag of 0.5 s (chance alone: within ±0.06)")
    beyond = whiteness.verdict(replace(white, largest=0.08))
    assert beyond.startswith("Residuals of the rate are slightly correlated (0.08 after 60 ms; chance alone")
    assert all(unseen in text for unseen in ("friction", "gain", "delay") for text in (said, beyond))
    assert "coloured (correlation 0.05 after 60 ms; chance" in whiteness.verdict(replace(white, white=False))
    assert whiteness.verdict(None) == ""


@pytest.mark.parametrize(
    "wrong",
    ["{", "[]", "{}", '{"schema": 1, "scenario": {}}', '{"schema": 0}', '{"schema": 1, "x": 2}', "[" * 100_000],
)
def test_what_is_no_summary_is_refused_in_a_line(wrong: str, tmp_path: Path) -> None:
    file = tmp_path / "summary.json"
    file.write_text(wrong)
    with pytest.raises(LeverError, match=r"summary.json: (not a summary of this version|schema 0, not 1)"):
        read(file)


@pytest.mark.parametrize("name", ["two_dof", "steady"])
def test_that_of_any_run_is_read_back(name: str) -> None:
    built = simulate(load_scenario(name, ["duration=3 s", "converged_after=1 s", "limits={}"])).summary
    content = json.loads(text(built))
    assert of(SimulationSummary, content) == built
    wrongs: tuple[dict[str, Any], ...] = (
        {"samples": "x"},
        {"passed": 1},
        {"scenario": None},
        {"modes_s": []},
        {"missed": [1]},
    )
    for wrong in wrongs:
        with pytest.raises(TypeError):
            of(SimulationSummary, content | wrong)


def test_a_summary_that_is_not_there_is_a_line(tmp_path: Path) -> None:
    with pytest.raises(LeverError, match=r"cannot read .*summary.json: No such file"):
        read(tmp_path / "summary.json")


def test_the_aircraft_of_another_process_is_not_known(load: Callable[..., Scenario]) -> None:
    scenario = load(TEXT, "aircraft={model='uh60_like',gearing='0.5 1'}", "limits={}")
    recording = loop.Recording(scenario, inputs.prepare(scenario))
    trace = perfect(recording)
    for own, said in ((True, False), (False, True)):
        recording.has_aircraft = own
        assert ("Which aircraft the estimator on the bus watches" in summary.build(recording, trace).verdict) == said


@pytest.mark.parametrize(("rms", "shown"), [(5.4, "5.4"), (5.01, "5.01"), (5.0004, "5.0004"), (12.345, "12.3")])
def test_a_limit_that_is_missed_does_not_look_kept(rms: float, shown: str) -> None:
    (text,) = summary.missed_limits({"m_p": 0.05}, {"m_p": rms}, {})
    assert text == f"rms error of m_p {shown} % (limit 5 %)"
    assert summary.missed_limits({"m_p": 0.05}, {"m_p": 5.0}, {}) == []


def test_limits_of_the_estimate_are_not_all_where_the_loop_was_unstable(recording: loop.Recording) -> None:
    """A run in which the loop was unstable for a while does not say that all limits are kept."""
    summarised = summary.build(recording, perfect(recording))
    assert summary.kept_limits(summarised) == "All limits kept."
    states = {"warning": 0.0, "alarm": 2.0}
    unstable = Stability(states, -1.0, 0.4, 5.0, 5.0, 4.0, None, "an aircraft", -1.3, 2.0)
    shaken = replace(summarised, stability=unstable)
    assert summary.kept_limits(summarised, shaken) == "The estimate keeps its limits, in a loop that was unstable."
