"""Tests of the defaults that the firmware gets for an aircraft, and of the limits within which an aircraft flies."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import ALARM, WARNING
from lever_cdkf.numeric.arrays import ComplexArray
from lever_sil.aircraft import aircraft, stability
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.response_table import alarm_limit, known_response, response_table
from lever_sil.aircraft.state_space import StateSpace, flyable, read
from lever_sil.aircraft.vector_fitting import fit


def test_a_table_has_24_frequencies_in_equal_ratios_from_1_5_to_8_hz() -> None:
    table = known_response(Coupled(aircraft.load("uh60_like"), 0.5)).pointer
    assert table.count == 24
    frequency = np.array(list(table.frequency)[:24])
    assert (frequency[0], frequency[-1]) == pytest.approx((1.5, 8.0))
    np.testing.assert_allclose(frequency[1:] / frequency[:-1], (8.0 / 1.5) ** (1.0 / 23.0), rtol=1e-5)
    assert (table.gain_sigma, table.phase_sigma) == pytest.approx((0.05, 0.05))
    assert (table.alarm, table.warning) == pytest.approx((ALARM, WARNING))
    assert (ALARM, WARNING) == (4.0, 5.0)


def test_an_alarm_comes_so_early_that_an_error_of_one_sigma_leaves_1_5_db() -> None:
    assert alarm_limit(0.05) == 4.0
    assert alarm_limit(0.3) == pytest.approx(1.5 - 20.0 * math.log10(0.7))
    assert alarm_limit(0.95) == alarm_limit(0.9) == pytest.approx(21.5)
    table = known_response(Coupled(aircraft.load("uh60_like"), 0.5), gain_sigma=0.4).pointer
    assert table.alarm == pytest.approx(1.5 - 20.0 * math.log10(0.6))
    assert table.warning - table.alarm == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("band", "enough"), [((2.0, 7.0), True), ((2.001, 8.0), False), ((1.0, 6.999), False), ((0.1, 30.0), True)]
)
def test_a_response_is_needed_from_2_to_7_hz(band: tuple[float, float], enough: bool) -> None:
    coupled = Coupled(aircraft.load("uh60_like"), 0.5)
    if not enough:
        with pytest.raises(LeverError, match=r"from 2 to 7 Hz at least, better from 1\.5 to 8 Hz"):
            response_table(coupled.response, band)
        return
    frequency = list(response_table(coupled.response, band).pointer.frequency)[:24]
    assert (frequency[0], frequency[-1]) == pytest.approx((max(1.5, band[0]), min(8.0, band[1])))


def test_64_states_fly_and_65_do_not(tmp_path: Path) -> None:
    for states in (64, 65):
        system = StateSpace(-np.eye(states), np.ones((states, 2)), np.ones((2, states)), np.eye(2))
        system.write(tmp_path / "a.csv", "")
        if states == 64:
            assert len(read(tmp_path / "a.csv").a) == 64
            continue
        with pytest.raises(LeverError, match="65 states; 64 at most"):
            read(tmp_path / "a.csv")


@pytest.mark.parametrize(("gain", "flies"), [(0.99, False), (1.01, True), (9.9e3, True), (1.01e4, False)])
def test_z_ddot_over_pitch_is_from_1_to_10000(gain: float, flies: bool) -> None:
    system = StateSpace(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.full((2, 2), gain))
    if flies:
        assert flyable(system, "x").d[0, 0] == gain
        return
    with pytest.raises(LeverError, match="it must be 1 to 10000"):
        flyable(system, "x")


@pytest.mark.parametrize(("pole", "flies"), [(-1e-3, True), (1e-3, False)])
def test_what_grows_does_not_fly(pole: float, flies: bool) -> None:
    """A slow mode that is on the brink is decided by its sign."""
    system = StateSpace(np.array([[pole]]), np.ones((1, 2)), np.ones((2, 1)), np.full((2, 2), 60.0))
    if flies:
        assert len(flyable(system, "x").a) == 1
        return
    with pytest.raises(LeverError, match="unstable: pole at"):
        flyable(system, "x")


def test_a_fit_has_as_few_poles_as_are_good_to_half_a_percent_and_sixteen_at_most() -> None:
    s = (2j * np.pi * np.geomspace(1.0, 10.0, 60)).astype(np.complex128)
    one: ComplexArray = 50.0 / (s**2 + 4.0 * s + 400.0)
    assert len(fit(s, one).system.a) == 2
    ripple: ComplexArray = one * (1.0 + 0.003 * np.cos(40.0 * np.log(np.abs(s))))
    assert len(fit(s, ripple).system.a) == 2, "it is good enough"
    noisy: ComplexArray = one * (1.0 + 0.05 * np.random.default_rng(1).standard_normal(60))
    assert 2 < len(fit(s, noisy).system.a) <= 16
    assert len(fit(s, noisy, 1).system.a) == 2


def test_a_loop_is_looked_at_from_half_a_hertz_to_20() -> None:
    assert stability.BAND == (0.5, 20.0)
