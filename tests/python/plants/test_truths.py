"""What every truth has in common: rest, disturbance, process noise, motor, friction, substeps that suffice."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.plants import lever_plant
from lever_sil.plants.hysteretic_plant import Hysteretic
from lever_sil.plants.lever_plant import Lever, LeverTruth
from lever_sil.plants.linear_plant import BlackBox, Physical
from lever_sil.plants.mayo_plant import HANDS, Mayo
from lever_sil.plants.reflex_plant import Reflex
from lever_sil.plants.truth import Truth
from lever_sil.plants.two_dof_plant import TwoDof
from python.plants.motion import LEVER, PERIOD, TRIM, body, columns, moved
from scipy import integrate

Make = Callable[[int, Lever], Truth]


def lever_truth(count: int, lever: Lever = LEVER, arm: tuple[float, ...] = (3.2, 60.0, 2100.0)) -> LeverTruth:
    return LeverTruth(lever, lever_plant.Truth(*columns(count, *arm, TRIM)), "trim")


def reflex(count: int, lever: Lever, delay: float = 0.035) -> Truth:
    return Reflex(lever, delay, *columns(count, 3.2, 50.0, 1800.0, 300.0, 15.0, TRIM))


WITH_LEVER: dict[str, Make] = {
    "lever": lever_truth,
    "two_dof": lambda n, lever: TwoDof(lever, *columns(n, 3.2, 60.0, 2100.0, 45.0, 1000.0, 36000.0, TRIM)),
    "hysteretic": lambda n, lever: Hysteretic(lever, 0.6, *columns(n, 3.2, 2100.0, TRIM)),
    "reflex": reflex,
}
PUSHED: dict[str, Make] = {**WITH_LEVER, "physical": lambda n, _: Physical(*columns(n, 3.2, 60.0, 2100.0, TRIM))}
EVERY: dict[str, Make] = {
    **PUSHED,
    "black_box": lambda n, _: BlackBox(*columns(n, -500.0, -14.0, -2.2, TRIM)),
    "hand": lambda n, _: Mayo(HANDS["mesomorphic"], 0.45, *columns(n, TRIM)),
}
DELAYED: dict[str, Make] = {"reflex late by part of a sample": lambda n, lever: reflex(n, lever, 0.0334)}


@pytest.mark.parametrize("make", PUSHED.values(), ids=PUSHED)
def test_it_rests_at_the_trim_until_a_disturbance_moves_it_as_an_equal_torque_would(make: Make) -> None:
    assert np.abs(moved(body(make(500, LEVER)), 500)).max() < 1e-12
    disturbed = body(make(500, LEVER), disturbance=0.4)
    path = moved(disturbed, 500)
    assert path[-1, 0] > 1e-4
    assert disturbed.tau_m == 0.0
    np.testing.assert_allclose(path, moved(body(make(500, LEVER)), 500, command=0.4), atol=1e-12)


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_the_motor_follows_its_command_with_its_lag(make: Make) -> None:
    for lag in (0.0, 2e-3):
        truth = make(11, LEVER)
        lever, torques = body(truth, lag=lag), []
        for _ in range(10):
            lever.advance(0.5)
            torques.append(lever.tau_m)
        assert torques == pytest.approx([0.5 * (1 - math.exp(-k / 2.0)) if lag else 0.5 for k in range(1, 11)])
        assert bool(lever.theta != TRIM) is truth.takes_torque


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_a_step_of_the_trim_takes_the_rest_position_along(make: Make) -> None:
    """That of the hysteretic arm by 99 %, since what relaxes slowest has not yet."""
    truth = make(3000, LEVER)
    with_trim: Any = truth.pilot if isinstance(truth, LeverTruth) else truth
    with_trim.trim[1000:] = 0.5
    last = moved(body(truth), 3000)[-1, 0] + TRIM
    assert last == pytest.approx(0.5, abs=1.5e-3 if isinstance(truth, Hysteretic) else 1e-5)


@pytest.mark.parametrize("hertz", [2.0, 8.0])
@pytest.mark.parametrize("make", (EVERY | DELAYED).values(), ids=EVERY | DELAYED)
def test_its_answer_to_the_base_is_that_of_its_transfer_function(make: Make, hertz: float) -> None:
    """To a sine that is small, so that the lever is linear; the last second of three, whole cycles."""
    wave, truth = np.exp(2j * math.pi * hertz * np.arange(3000) * PERIOD), make(3000, LEVER)
    path = moved(body(truth, 0.01 * wave.real), 3000)[2000:, 0]
    found = 2.0 * np.mean(path / wave[2000:]) / 0.01
    assert found == pytest.approx(truth.transfer(np.array([0])).response(np.array([hertz]))[0, 0], rel=2e-3)


@pytest.mark.parametrize("substeps", [None, 1])
@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_process_noise_has_its_strength_whatever_the_substeps(make: Make, substeps: int | None) -> None:
    count = 5000
    lever = body(make(count, LEVER), noise=0.05, substeps=substeps)
    kicks = np.empty(count - 1)
    for k in range(count - 1):
        lever.theta, lever.theta_dot = TRIM, 0.0
        lever.advance(0.0)
        kicks[k] = lever.theta_dot
    assert np.std(kicks) == pytest.approx(0.05 * math.sqrt(PERIOD), rel=0.04)


@pytest.mark.parametrize("make", WITH_LEVER.values(), ids=WITH_LEVER)
def test_the_substeps_suffice_with_friction(make: Make) -> None:
    """A lever that sticks and slips, against eight times as many substeps."""
    count = 1200
    base = 0.6 * np.sin(2 * math.pi * 3.0 * np.arange(count) * PERIOD)
    truth = make(count, dataclasses.replace(LEVER, lever_friction=0.3))
    path, fine = moved(body(truth, base), count), moved(body(truth, base, substeps=32), count)
    assert np.abs(path - fine).max(axis=0) == pytest.approx([0.0, 0.0], abs=2e-3 * np.ptp(fine, axis=0).max())
    free = moved(body(make(count, LEVER), base), count)
    assert np.ptp(fine[600:, 0]) < 0.9 * np.ptp(free[600:, 0])


def test_motion_with_friction_is_that_of_a_stiff_solver() -> None:
    """The lever alone, hands off, where friction is steepest: Radau."""
    count = 1500
    time = np.arange(count) * PERIOD
    lever = dataclasses.replace(LEVER, lever_friction=0.3)
    truth = lever_truth(count, lever, (0.0, 0.0, 0.0))
    push = 0.5 * np.sin(2 * math.pi * 1.5 * time)

    def derivative(now: float, x: FloatArray) -> list[float]:
        friction = 0.3 * x[1] / math.sqrt(x[1] ** 2 + 0.002**2)
        torque = np.interp(now, time, push) - friction - 0.5 * x[1] - 5.0 * x[0]
        return [x[1], torque / lever.own_inertia]

    exact = integrate.solve_ivp(derivative, (0, time[-1]), [0.0, 0.0], "Radau", t_eval=time, rtol=1e-6, atol=1e-9).y
    path = moved(body(truth, disturbance=push), count)
    assert np.all(np.abs(path.T - exact).max(axis=1) < 3e-3 * np.ptp(exact, axis=1))


def test_let_go_the_lever_swings_by_its_own_spring_and_nothing_is_known_of_a_pilot() -> None:
    count = 2000
    truth = lever_truth(count)
    for column in (truth.pilot.m_p, truth.pilot.c_p, truth.pilot.k_p):
        column[500:1500] = 0.0
    off = (np.arange(count) >= 500) & (np.arange(count) < 1500)
    for column in (*truth.parameters.values(), *vars(truth.dynamics).values()):
        assert np.array_equal(np.isnan(column), off)
    lever = body(truth)
    for _ in range(500):
        lever.advance(0.0)
    lever.theta += 0.1
    path = moved(lever, 1000)[:, 0]
    omega, decay = math.sqrt(5.0 / LEVER.own_inertia), 0.5 / (2 * LEVER.own_inertia)
    time, damped = np.arange(1000) * PERIOD, math.sqrt(omega**2 - decay**2)
    expected = 0.1 * np.exp(-decay * time) * (np.cos(damped * time) + decay / damped * np.sin(damped * time))
    assert path == pytest.approx(expected, abs=1e-5)
    frequency = np.array([0.5, 1.25, 4.0])
    s = 2j * math.pi * frequency
    answer = -0.45 * 0.6 * math.cos(TRIM) / (LEVER.own_inertia * s**2 + 0.5 * s + 5.0)
    assert truth.transfer(np.array([700])).response(frequency)[0] == pytest.approx(answer)
