"""A trace as the report reads it: what is there, what follows from it, and what a summary adds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import settings_table
from lever_cdkf.firmware.estimator import DO_NOT_TRUST
from lever_cdkf.firmware.library import enum_names
from lever_cdkf.firmware.quantities import parameters
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import ComplexArray
from lever_cdkf.report import bode
from lever_cdkf.report.charts import health
from lever_cdkf.report.run import Run, nis_averages
from lever_cdkf.report.series import coarse, envelope, jumps, packed, spread_indices, welch
from lever_cdkf.results.faults import FaultCounts, warning_bits
from lever_cdkf.results.summary import TrueTransfer, Truth
from lever_cdkf.results.trust import next_step, warning
from lever_sil.run.runner import SimulationResult

from .reading import unpack

TIME = np.arange(2000) * 0.005
BITS = {name: bit for bit, name in enum_names("lever_fault").items()}


def run(**columns: Any) -> Run:
    full = {
        name: np.full(len(TIME), value) if np.ndim(value) == 0 else np.asarray(value) for name, value in columns.items()
    }
    return Run({"time_s": TIME, **full}, None)


def test_a_column_that_holds_nothing_is_as_absent() -> None:
    found = run(a=1.0, b=np.nan)
    assert found.column("a") is not None
    assert found.column("b") is found.column("c") is None
    assert found.first_name("c", "b", "a") == "a"
    assert found.first_name("b", "c") is None
    assert found.first_of("b", "c") is None
    both = run(a=1.0, b=2.0).first_of("b", "a")
    assert both is not None
    assert both[0] == 2.0


def test_what_follows_from_the_time() -> None:
    found = run()
    assert found.end == pytest.approx(9.995)
    assert found.samples == 2000
    assert found.sample_period == pytest.approx(0.005)
    assert found.settled == slice(200, None)
    assert Run({"time_s": np.zeros(1)}, None).sample_period == 1.0


@pytest.mark.parametrize("model", enum_names("lever_model").values())
def test_without_a_summary_the_columns_say_the_model(model: str) -> None:
    found = run(**{parameters(model)[0].column("estimate"): 1.0})
    assert found.model == model
    assert found.parameters == parameters(model)
    assert run().model == "lever"
    assert (found.simulated, found.replayed, found.recording, found.mismatch) == (None, None, None, None)
    assert (found.about_truth, found.about_true_dynamics) == ("", "")
    assert found.settings == {row.name: row.default for row in settings_table()}
    assert found.lever.preload == "trim"


def test_truth_of_another_kind(result: SimulationResult) -> None:
    transfer = TrueTransfer([0.0, 5.0], [[1.0], [2.0]], [[1.0, 0.0], [1.0, 3.0]])
    other = Truth("two_dof", "it has a trunk", "of the first mode", transfer)
    found = Run(result.trace, replace(result.summary, truth=other))
    assert (found.mismatch, found.about_truth, found.about_true_dynamics) == (
        "two_dof",
        "it has a trunk",
        "of the first mode",
    )
    at = found.true_transfer(np.array([-1.0, 0.0, 4.9, 5.0, 9.0]))
    assert at is not None
    assert at.numerator[:, 0].tolist() == [1.0, 1.0, 1.0, 2.0, 2.0]
    plain = Run(result.trace, result.summary)
    assert plain.true_transfer(TIME) is None
    assert plain.mismatch is None
    assert plain.has_truth
    assert not run(a=1.0).has_truth


def test_what_is_flagged_is_what_the_firmware_says_not_to_trust() -> None:
    faults = np.zeros(len(TIME))
    faults[10], faults[20], faults[30], faults[40] = BITS["base"], BITS["excitation"], BITS["torque"], np.nan
    measured = {"tau_m_measured_N_m": 0.1, "theta_dot_measured_rad_s": 0.1}
    assert np.flatnonzero(run(faults=faults, **measured).flagged).tolist() == [10, 30]
    assert np.flatnonzero(run(faults=faults).flagged).tolist() == [10]  # no torque was ever measured
    assert not run().flagged.any()


def test_changes_are_jumps_of_the_truth_and_of_the_trim() -> None:
    truth = np.where(TIME < 3.0, 2.0, 2.5)
    trim = np.where(TIME < 6.0, 0.3, 0.4)
    assert run(m_p_true_kg=truth, trim_true_rad=trim).changes == pytest.approx([3.0, 6.0])
    assert run(m_p_true_kg=truth * 1.01**0).changes == pytest.approx([3.0])
    assert run().changes == []


def test_averages_of_innovations() -> None:
    nis = np.tile([1.0, 3.0, 0.0, np.nan], 500)  # 0: nothing was compared
    found = run(nis=nis, theta_measured_rad=0.1, theta_dot_measured_rad_s=np.where(TIME < 5.0, 0.1, np.nan))
    averages = found.innovations(0.25)
    assert averages is not None
    assert averages.seconds == 0.25
    assert len(averages.time) == 40
    assert averages.time[0] == pytest.approx(TIME[:50].mean())
    assert averages.total[0] == pytest.approx(np.nansum(nis[:50]))
    assert (averages.freedom[0], averages.freedom[-1]) == (2.0 * np.sum(nis[:50] > 0.0), np.sum(nis[1950:] > 0.0))
    assert run().innovations(0.25) is None
    alone = run(nis=2.0).innovations(0.25)  # without columns of outputs both are taken for measured
    assert alone is not None
    assert alone.freedom[0] == 100.0
    odd = nis_averages(np.arange(7.0), np.ones(7), np.full(7, 2), 3, 1.0)
    assert (odd.time.tolist(), odd.total.tolist(), odd.freedom.tolist()) == ([1.0, 4.0], [3.0, 3.0], [6.0, 6.0])


def test_spectra_and_close_ups() -> None:
    tone = np.sin(2.0 * math.pi * 5.0 * TIME)
    found = run(z_ddot_measured_m_s2=tone)
    frequency, power = found.spectrum("z_ddot_measured_m_s2")
    assert frequency[np.argmax(power)] == pytest.approx(5.0)
    assert np.sum(power) * (frequency[1] - frequency[0]) == pytest.approx(0.5, rel=0.05)  # its mean square
    close = found.close_up(2.0, 1.0)
    assert (close["time_s"][0], close["time_s"][-1], len(close["time_s"])) == (2.0, 3.0, 201)
    assert found.coherence is None
    assert run(z_ddot_measured_m_s2=tone, theta_measured_rad=tone).coherence is not None
    assert found.followed_trim is None
    assert found.whiteness is None
    residual = run(
        theta_dot_measured_rad_s=np.random.default_rng(1).standard_normal(2000), theta_dot_estimate_rad_s=0.0
    )
    assert residual.whiteness is not None


# --- series ----------------------------------------------------------------------------------------------------------


def test_points_are_spread_evenly_and_some_are_kept() -> None:
    assert spread_indices(5, 10).tolist() == [0, 1, 2, 3, 4]
    assert spread_indices(101, 5).tolist() == [0, 25, 50, 75, 100]
    assert spread_indices(101, 5, np.array([60])).tolist() == [0, 25, 50, 59, 60, 75, 100]
    assert spread_indices(101, 3, np.array([0])).tolist() == [0, 50, 100]


def test_an_envelope_keeps_extremes() -> None:
    time, values = np.arange(100.0), np.arange(100.0) % 10
    short = envelope(time, values, 50)
    assert short[0] is time
    x, y = envelope(time, values, 10)
    assert x.tolist() == np.repeat(np.arange(0.0, 100.0, 10.0), 2).tolist()
    assert y.tolist() == [0.0, 9.0] * 10
    holes = np.where(time < 10.0, np.nan, values)
    assert np.isnan(envelope(time, holes, 10)[1][:2]).all()
    assert len(envelope(np.arange(95.0), np.arange(95.0), 10)[1]) == 20


def test_jumps_are_relative_and_apart() -> None:
    time = np.arange(10.0)
    steps = np.array([1.0, 1.0, 1.021, 1.021, 1.03, 1.03, 2.0, 2.0, 2.0, 2.0])
    assert jumps(time, [steps]) == [2.0, 6.0]
    assert jumps(time, [steps], relative=0.005) == [2.0, 4.0, 6.0]
    assert jumps(time, [steps], apart=4.5) == [2.0]  # 4 s after it is the same
    assert jumps(time, [np.zeros(10)]) == jumps(time[:1], [np.ones(1)]) == []


def test_packing_and_coarseness() -> None:
    assert unpack(packed(np.array([[1.0, 2.0], [3.0, 4.0]]))).tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert packed(np.zeros(3))["dtype"] == "f4"
    values = np.array([1.0, 1.0 / 3.0, 12345.678, np.nan, 0.0])
    np.testing.assert_allclose(coarse(values), values, rtol=2.0**-14)
    assert coarse(values, 4)[1] == 0.34375
    frequency, power = welch(np.random.default_rng(1).standard_normal(100), 0.1)  # shorter than a window
    assert (len(frequency), len(power), frequency[-1]) == (21, 21, pytest.approx(5.0))  # of windows of 4 s


# --- the response ----------------------------------------------------------------------------------------------------


def test_phases_go_on_downwards() -> None:
    frequency = np.linspace(0.1, 20.0, 400)
    s: ComplexArray = 2j * math.pi * frequency.astype(np.complex128)
    against: ComplexArray = -1.0 / (s**2 + 2.0 * s + 400.0)
    magnitude, phase = bode.magnitude_and_phase(against)
    np.testing.assert_allclose(magnitude, np.abs(against))
    assert phase[0] == pytest.approx(-180.0, abs=1.0)
    assert phase[-1] == pytest.approx(-360.0, abs=2.0)
    along = bode.magnitude_and_phase(-against)[1]
    assert along[0] == pytest.approx(0.0, abs=1.0)
    assert along[-1] == pytest.approx(-180.0, abs=2.0)
    flat = Transfer(np.array([[2.0]]), np.array([[1.0, 0.0]])).response(np.array([1.0]))
    assert flat[0, 0] == pytest.approx(2.0 / (2j * math.pi))


def test_the_trim_is_followed_slowly_and_held() -> None:
    time = np.arange(0.0, 60.0, 0.01)
    theta = np.where(time < 30.0, 0.3, np.nan)
    held = bode.slow_trim(time, theta, 0.05)
    np.testing.assert_allclose(held, 0.3, atol=1e-9)
    stepped = bode.slow_trim(time, np.where(time < 10.0, 0.3, 0.5), 0.1)
    assert stepped[1010] < 0.36
    assert stepped[-1] == pytest.approx(0.5, abs=0.01)
    assert bode.slow_trim(time, np.full(len(time), np.nan), 0.1)[-1] == 0.0


# --- faults and trust ------------------------------------------------------------------------------------------------


def test_shares_of_faults() -> None:
    counts = FaultCounts()
    assert counts.warned_share is None
    column = np.array([0.0, BITS["base"], BITS["base"] | BITS["gap"], BITS["torque"], np.nan])
    counts.add(column[:2])
    counts.add(column[2:])
    assert counts.samples == 4
    assert counts.shares == {"base": 0.5, "gap": 0.25, "torque": 0.25}
    assert counts.warned_share == 0.75
    without = FaultCounts()
    without.add(column, ("torque",))
    assert without.shares == {"base": 0.5, "gap": 0.25}
    assert without.warned_share == 0.5
    assert warning_bits() == DO_NOT_TRUST
    assert warning_bits(("torque", "gap")) == DO_NOT_TRUST & ~BITS["torque"] & ~BITS["gap"]


@pytest.mark.parametrize(
    ("cause", "step"),
    [
        ("clock", "check the time of the samples, and sample_period"),
        ("theta", "check the sensor of theta, its unit and its limits"),
        ("theta_dot", "check the sensor of theta_dot, its unit and its limits"),
        ("base", "check sign, unit and gravity of z_ddot"),
        ("torque", "check sign and unit of tau_m"),
        ("recovered", "check settings and first guess: the filter was restarted"),
        ("hands_off", "take the part in which somebody holds the lever (--start, --length)"),
        ("calibration", "lever tune x"),
        ("mismatch", "lever tune x"),
        ("innovation", "lever tune x"),
        ("bound", "lever tune x"),
        ("gap", ""),
    ],
)
def test_what_to_do_about_each_fault(cause: str, step: str) -> None:
    assert next_step({cause: 0.3}, "lever tune x") == step
    assert next_step({cause: 0.01}, "lever tune x") == ""
    said = warning({cause: 0.3}, 0.3)
    assert said.startswith("Do not trust the estimates 30 % of the time: ") if step else said == ""
    if step:
        assert "(30 % of the time" in said
        assert warning({cause: 0.6}, 0.6).startswith("Do not trust the estimates: ")
        assert warning({cause: 0.3}, 0.02) == warning({cause: 0.3}, None) == ""


@pytest.mark.parametrize(("share", "said"), [(0.019, False), (0.021, True)])
def test_two_per_cent_of_the_time_are_a_passing_fault(share: float, said: bool) -> None:
    assert bool(warning({"base": 0.3}, share)) is said
    assert bool(warning({"base": share}, 0.3)) is said
    assert bool(next_step({"base": share})) is said


@pytest.mark.parametrize(("share", "whole"), [(0.49, False), (0.51, True)])
def test_half_of_the_time_with_a_warning_is_the_run_as_a_whole(share: float, whole: bool) -> None:
    assert warning({"base": share}, share).startswith("Do not trust the estimates: ") is whole


def test_a_short_fault_is_drawn_long_enough_to_be_seen() -> None:
    """As long as two thousandths of the time."""
    faults = np.where(np.arange(len(TIME)) == 1000, float(BITS["gap"]), 0.0)
    figure = health.timeline(run(mode=2.0, faults=faults))
    assert figure is not None
    (bar,) = (trace for trace in figure.traces if trace["name"] == "fault: gap")
    assert bar["x"][1] - bar["x"][0] == pytest.approx(0.002 * TIME[-1], abs=1e-4)
    assert bar["x"][0] == pytest.approx(5.0, abs=0.01)
