"""The trace: the contract's columns, made from the frames on the bus, and trace.csv holding the same."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.results import trace
from lever_sil.run import loop
from lever_sil.run.columns import columns_of
from lever_sil.scenarios import scenario
from lever_sil.scenarios.scenario import Scenario
from python.conftest import PuppetBus, estimate, health

COLUMNS = """
time_s theta_true_rad theta_dot_true_rad_s z_ddot_true_m_s2 tau_m_true_N_m
trim_true_rad m_p_true_kg c_p_true_N_s_m k_p_true_N_m natural_frequency_true_Hz damping_ratio_true
theta_measured_rad theta_dot_measured_rad_s z_ddot_measured_m_s2 tau_m_measured_N_m
grip_force_measured_N
theta_estimate_rad theta_dot_estimate_rad_s nis m_p_estimate_kg m_p_sigma_kg c_p_estimate_N_s_m c_p_sigma_N_s_m
k_p_estimate_N_m k_p_sigma_N_m natural_frequency_estimate_Hz natural_frequency_sigma_Hz damping_ratio_estimate
damping_ratio_sigma feedthrough_frequency_Hz feedthrough_real_rad_s2_m feedthrough_imaginary_rad_s2_m
feedthrough_gain_sigma feedthrough_phase_sigma_rad mode faults lost corrupt late restarts excitation_rad_s dither_N_m
""".split()  # noqa: SIM905


def answers(sample: int) -> list[tuple[str, dict[str, Any]]]:
    """Return parameters each 20th sample from 40 on, health each 100th, dither from 250 on, no answer at 333, one
    that may not be used at 222, no innovation at 111."""
    if sample == 333:
        return []
    frames: list[tuple[str, dict[str, Any]]] = []
    if sample >= 250:
        frames.append(("MOTOR_COMMAND", {"torque": 0.2, "dither": 0.1 + sample * 1e-3}))
    if sample >= 40 and sample % 20 == 0:
        frames.append(("PILOT_PARAMETERS", {"m_p": sample * 0.01, "c_p": 42.0, "k_p": 1500.0}))
        frames.append(("PILOT_SIGMA", {"m_p_sigma": 0.5, "c_p_sigma": 3.0, "k_p_sigma": 90.0}))
    if sample % 100 == 0:
        count = sample // 100  # since power-on: both wrap
        frames.append(health("run", "excitation", restarts=(3 + 70 * count) % 256, excitation=0.25))
        frames.append(("LINK_HEALTH", {"lost": 65535 - 70 + 70 * count, "corrupt": 0, "late": 7}))
    valid = int(sample != 222)
    return [*frames, estimate(theta=sample * 1e-3, innovation=1.5 if sample != 111 else None, valid=valid)]


def traced(*overrides: str) -> tuple[loop.Recording, trace.Trace]:
    wanted = scenario.load("sensor_dropout", ["duration=0.5 s", *overrides])
    recording = loop.run(wanted, PuppetBus(answers))
    return recording, columns_of(recording, recording.frames())


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("linear_physical", {"m": "_kg", "c": "_N_s_m", "k": "_N_m"}),
        ("linear_black_box", {"a21": "_1_s2", "a22": "_1_s", "b21": ""}),
    ],
)
def test_parameters_are_those_of_the_estimators_model(
    lever_bus: Callable[[Scenario], LeverBus], model: str, parameters: dict[str, str]
) -> None:
    wanted = scenario.load(model, ["duration=1 s"])
    recording = loop.run(wanted, lever_bus(wanted))
    frames = recording.frames()
    columns = columns_of(recording, frames)
    expected = COLUMNS
    for old, (new, ending) in zip(("m_p_", "c_p_", "k_p_"), parameters.items(), strict=True):
        expected = [f"{new}_{name.split('_')[2]}{ending}" if name.startswith(old) else name for name in expected]
    assert list(columns) == expected
    last = codec.decode(0x211, frames.data[frames.of(0x211)[-1]].tobytes())[1]
    for name, ending in parameters.items():
        assert columns[f"{name}_estimate{ending}"][-1] == last[name]
        assert columns[f"{name}_true{ending}"][0] == recording.inputs.truth.parameters[name][0]


def test_measured_is_what_was_on_the_bus_and_nan_where_it_was_not() -> None:
    recording, columns = traced("sensors.dropout.2.start=0.1 s", "sensors.dropout.2.end=0.2 s")
    missing = recording.inputs.missing
    no_theta = missing["theta"] | missing["lever_frame"]
    assert np.array_equal(np.isnan(columns["theta_measured_rad"]), no_theta)
    assert np.array_equal(np.isnan(columns["z_ddot_measured_m_s2"]), missing["z_ddot"] | missing["base_frame"])
    error = (columns["theta_measured_rad"] - columns["theta_true_rad"])[~no_theta]
    assert 0.5e-3 < np.std(error) < 1.5e-3


def test_estimates_stand_at_their_sample_and_slower_frames_are_held() -> None:
    wanted = scenario.load("steady", ["duration=0.5 s"])
    recording = loop.run(wanted, PuppetBus(answers))
    columns = columns_of(recording, recording.frames())
    sample = np.arange(500)
    assert np.flatnonzero(np.isnan(columns["theta_estimate_rad"])).tolist() == [222, 333]
    there = np.delete(sample, [222, 333])
    assert columns["theta_estimate_rad"][there] == pytest.approx(there * 1e-3, abs=1.01e-4)
    assert np.flatnonzero(np.isnan(columns["nis"])).tolist() == [111, 222, 333]
    assert columns["nis"][0] == 1.5**2
    assert np.isnan(columns["m_p_estimate_kg"][:40]).all()
    assert columns["m_p_estimate_kg"][40:] == pytest.approx(sample[40:] // 20 * 20 * 0.01)
    assert columns["k_p_sigma_N_m"][499] == 90.0
    expected = np.where((sample >= 250) & (sample != 333), 0.1 + sample * 1e-3, 0.0)
    assert columns["dither_N_m"] == pytest.approx(expected, abs=1e-9)


def test_counts_start_at_zero_and_go_on_beyond_their_bits() -> None:
    _, columns = traced("sensors.dropout=[{what='theta', share='1 %'}]")
    for name in ("lost", "restarts"):
        assert columns[name][[0, 150, 250, 350, 499]].tolist() == [0, 70, 140, 210, 280]
    assert columns["late"].max() == 0
    assert set(columns["mode"]) == {2.0}
    assert set(columns["faults"]) == {128.0}


def test_truth_is_linearised_where_the_lever_rests() -> None:
    wanted = scenario.load("re_trim", ["duration=0.5 s", "pilot.trim.start=0.1 s", "pilot.trim.duration=0.2 s"])
    recording = loop.run(wanted, PuppetBus(answers))
    columns = columns_of(recording, recording.frames())
    trim = np.radians(np.interp(np.arange(500), (100, 300), (20, 28)))
    assert columns["trim_true_rad"] == pytest.approx(trim)
    arm, mass = 0.45**2, 0.45**2 * (0.25 * 1.2 + 3.2) + 0.020
    stiffness = arm * 2100 * np.cos(trim) ** 2 + 5.0
    assert columns["natural_frequency_true_Hz"] == pytest.approx(np.sqrt(stiffness / mass) / (2 * np.pi))
    damping = (arm * 60 * np.cos(trim) ** 2 + 0.5) / (2 * np.sqrt(stiffness * mass))
    assert columns["damping_ratio_true"] == pytest.approx(damping)


def test_numbers_are_rounded_to_the_nearest() -> None:
    """As Python does it, which is exact: of two that are as near the even one."""
    rng = np.random.default_rng(1)
    ties = rng.integers(-(2**32), 2**32, 20000) / 2.0**7
    near = np.nextafter(ties, rng.choice([-np.inf, np.inf], len(ties)))
    wide = rng.choice([-1.0, 1.0], 20000) * 10.0 ** rng.uniform(-12.0, 18.0, 20000)
    halves = np.round(rng.uniform(-10.0, 10.0, 20000), 6) + 0.5e-6
    some = [0.0, -0.0, np.nan, np.inf, -np.inf, 0.9999995, 0.99999949999, 1e-300, 2.0**52, 2.0**53 + 2.0]
    values = np.concatenate((some, ties, near, wide, halves))
    lines = bytes(trace.csv_lines({"a": values, "b": values[::-1]})).decode().splitlines()
    expected = [f"{value:.6f}".replace("nan", "NaN") for value in values.tolist()]
    assert lines == [f"{one},{other}" for one, other in zip(expected, expected[::-1], strict=True)]


def test_whole_numbers_have_no_decimals() -> None:
    values = np.array([0.0, -0.0, 7.0, -12.0, 2.0**32, np.nan])
    text = bytes(trace.csv_lines({"nis": values, "lost": values})).decode()
    assert text.splitlines()[:2] == ["0.000000,0", "-0.000000,0"]
    assert text.splitlines()[2:] == ["7.000000,7", "-12.000000,-12", "4294967296.000000,4294967296", "NaN,"]


def test_csv_holds_the_trace(tmp_path: Path) -> None:
    _, columns = traced()
    with (tmp_path / "trace.csv").open("wb") as file:
        trace.write_csv_header(columns, file)
        trace.write_csv_rows(columns, file)
    lines = (tmp_path / "trace.csv").read_text().splitlines()
    assert lines[0].split(",") == COLUMNS
    table = np.genfromtxt(tmp_path / "trace.csv", delimiter=",", names=True)
    for name, column in columns.items():
        assert np.array_equal(np.isnan(table[name]), np.isnan(column))
        assert np.nan_to_num(table[name]) == pytest.approx(np.nan_to_num(column), abs=0.51e-6)
    assert lines[1].split(",")[COLUMNS.index("faults")] == "128"
