"""What every truth with a lever has in common: rest, disturbance, process noise, friction, substeps that suffice."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from lever_cdkf.host_tools.arrays import FloatArray
from lever_cdkf.sil.plants import lever_plant
from lever_cdkf.sil.plants.hysteretic_plant import Hysteretic
from lever_cdkf.sil.plants.lever_plant import STOP_RATE, Lever, LeverTruth
from lever_cdkf.sil.plants.linear_plant import Physical
from lever_cdkf.sil.plants.reflex_plant import Reflex
from lever_cdkf.sil.plants.truth import Body, Conditions, Truth
from lever_cdkf.sil.plants.two_dof_plant import TwoDof
from scipy import integrate

PERIOD, TRIM = 1e-3, 0.35
LEVER = Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, 0.0, 0.0)
Make = Callable[[int, Lever], Truth]


def columns(count: int, *values: float) -> list[FloatArray]:
    return [np.full(count, value) for value in values]


def lever_truth(count: int, lever: Lever = LEVER, arm: tuple[float, ...] = (3.2, 60.0, 2100.0)) -> LeverTruth:
    return LeverTruth(lever, lever_plant.Truth(*columns(count, *arm, TRIM)), "trim")


WITH_LEVER: dict[str, Make] = {
    "lever": lever_truth,
    "two_dof": lambda n, lever: TwoDof(lever, *columns(n, 3.2, 60.0, 2100.0, 45.0, 1000.0, 36000.0, TRIM)),
    "hysteretic": lambda n, lever: Hysteretic(lever, 0.6, *columns(n, 3.2, 2100.0, TRIM)),
    "reflex": lambda n, lever: Reflex(lever, 0.035, *columns(n, 3.2, 50.0, 1800.0, 300.0, 15.0, TRIM)),
}
PUSHED: dict[str, Make] = {**WITH_LEVER, "physical": lambda n, _: Physical(*columns(n, 3.2, 60.0, 2100.0, TRIM))}


def moved(body: Body, count: int, command: float = 0.0) -> FloatArray:
    """(samples, 2): theta - trim and theta_dot."""
    path = [(body.theta, body.theta_dot)]
    for _ in range(count - 1):
        body.advance(command)
        path.append((body.theta, body.theta_dot))
    return np.array(path) - (TRIM, 0.0)


def body(
    truth: Truth,
    base: FloatArray | float = 0.0,
    *,
    noise: float = 0.0,
    substeps: int | None = None,
    disturbance: FloatArray | float = 0.0,
) -> Body:
    z_ddot = np.broadcast_to(base, len(truth.rest)).astype(np.float64)
    return truth.body(Conditions(z_ddot, PERIOD, noise, 0.0, np.random.default_rng(1), substeps, disturbance))


@pytest.mark.parametrize("make", PUSHED.values(), ids=PUSHED)
def test_it_rests_at_the_trim_until_a_disturbance_moves_it_as_an_equal_torque_would(make: Make) -> None:
    assert np.abs(moved(body(make(500, LEVER)), 500)).max() < 1e-12
    disturbed = body(make(500, LEVER), disturbance=0.4)
    path = moved(disturbed, 500)
    assert path[-1, 0] > 1e-4
    assert disturbed.tau_m == 0.0
    assert path == pytest.approx(moved(body(make(500, LEVER)), 500, command=0.4), abs=1e-12)


@pytest.mark.parametrize("make", WITH_LEVER.values(), ids=WITH_LEVER)
def test_process_noise_has_its_strength(make: Make) -> None:
    count = 10_000
    lever = body(make(count, LEVER), noise=0.05)
    kicks = np.empty(count - 1)
    for k in range(count - 1):
        lever.theta, lever.theta_dot = TRIM, 0.0
        lever.advance(0.0)
        kicks[k] = lever.theta_dot
    assert np.std(kicks) == pytest.approx(0.05 * math.sqrt(PERIOD), rel=0.04)


@pytest.mark.parametrize("make", WITH_LEVER.values(), ids=WITH_LEVER)
def test_the_substeps_suffice_with_friction(make: Make) -> None:
    """A lever that sticks and slips, against eight times as many substeps."""
    count = 2000
    base = 0.6 * np.sin(2 * math.pi * 3.0 * np.arange(count) * PERIOD)
    truth = make(count, dataclasses.replace(LEVER, lever_friction=0.3))
    path, fine = moved(body(truth, base), count), moved(body(truth, base, substeps=32), count)
    assert np.abs(path - fine).max(axis=0) == pytest.approx([0.0, 0.0], abs=2e-3 * np.ptp(fine, axis=0).max())
    free = moved(body(make(count, LEVER), base), count)
    assert np.ptp(fine[1000:, 0]) < 0.9 * np.ptp(free[1000:, 0])


SPRING = Lever(0.45, 1.2, 0.5, 0.020, 0.0, 400.0, 0.0, 0.0, lever_friction=0.3)
WEIGHT = (3.2, 0.0, 0.0)
"""A hand that only has mass, on a lever with a straight spring and friction: Coulomb's textbook case."""


def test_free_decay_under_friction_is_linear_in_time() -> None:
    """By 2 T_f / k each half period, whatever the amplitude; v_f rounds the corners."""
    truth = lever_truth(3000, SPRING, WEIGHT)
    lever = body(truth)
    lever.theta += 0.02
    path = moved(lever, 3000)[:, 0]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(path))) != 0) + 1
    swings = np.abs(path[turns])[:10]
    assert np.diff(swings) == pytest.approx(np.full(9, -2 * 0.3 / 400.0), rel=0.02)
    period = 2 * math.pi * math.sqrt(lever_plant.inertia(SPRING, truth.pilot)[0] / 400.0)
    assert np.diff(turns)[:9] * PERIOD == pytest.approx(np.full(9, period / 2), abs=2 * PERIOD)


def test_in_a_limit_cycle_friction_takes_four_times_its_torque_times_the_amplitude_each_cycle() -> None:
    """Energy that the base puts in, over the last 5 of 60 cycles at 3 Hz."""
    count = 20_001
    base = 1.2 * np.sin(2 * math.pi * 3.0 * np.arange(count) * PERIOD)
    lever = dataclasses.replace(SPRING, lever_damping=0.5)
    truth = lever_truth(count, lever, WEIGHT)
    theta, rate = moved(body(truth, base), count)[-5001:].T
    power = -lever_plant.moment(lever, truth.pilot)[0] * np.cos(theta + TRIM) * base[-5001:] * rate
    lost = integrate.trapezoid(power - 0.5 * rate**2, dx=PERIOD) / 15.0
    assert lost == pytest.approx(4 * 0.3 * 0.5 * np.ptp(theta), rel=0.01)


def test_at_rest_friction_is_a_damper() -> None:
    """Of T_f / v_f: under little noise the rate has the variance of an Ornstein-Uhlenbeck process."""
    count, noise = 40_000, 0.004
    truth = lever_truth(count, dataclasses.replace(SPRING, lever_stiffness=0.0), WEIGHT)
    mass = lever_plant.inertia(SPRING, truth.pilot)[0]
    rate = moved(body(truth, noise=noise), count)[1000:, 1]
    assert np.std(rate) == pytest.approx(noise * math.sqrt(0.5 * mass * STOP_RATE / 0.3), rel=0.05)


def test_motion_with_friction_is_that_of_a_stiff_solver() -> None:
    """The lever alone, hands off, where friction is steepest: Radau."""
    count = 1500
    time = np.arange(count) * PERIOD
    lever = dataclasses.replace(LEVER, lever_friction=0.3)
    truth = lever_truth(count, lever, (0.0, 0.0, 0.0))
    push = 0.5 * np.sin(2 * math.pi * 1.5 * time)

    def derivative(now: float, x: FloatArray) -> list[float]:
        friction = 0.3 * x[1] / math.sqrt(x[1] ** 2 + STOP_RATE**2)
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
