"""The plant against the Lagrangian and scipy's integrators."""

import dataclasses
import math

import numpy as np
import pytest
from lever_cdkf.text.units import GRAVITY
from lever_sil.plants.lever_plant import LeverTruth, Preload, Truth
from python.plants.motion import LEVER, PERIOD, TRIM, body, columns, lagrange, moved
from scipy import integrate

Arm = tuple[float, float, float]
ARM: Arm = (3.2, 60.0, 2100.0)


def held(arm: Arm = ARM, kind: Preload = "trim", count: int = 2) -> LeverTruth:
    return LeverTruth(LEVER, Truth(*columns(count, *arm, TRIM)), kind)


def acceleration(kind: Preload, arm: Arm, theta: float, rate: float, z_ddot: float = 0.0, torque: float = 0.0) -> float:
    """By the Lagrangian; in preload trim the arm's spring carries its weight and the lever's at the trim."""
    stretch, own = LEVER.lever_length * math.sin(LEVER.arm_preload_angle), LEVER.lever_preload_angle
    if kind == "trim":
        weight = GRAVITY * (LEVER.lever_mass_position * LEVER.lever_mass + arm[0])
        stretch, own = LEVER.lever_length * math.sin(TRIM) + weight / arm[2], TRIM
    return float(lagrange(False)[0](theta, rate, *arm, z_ddot, torque, stretch, own)[0, 0])


both = pytest.mark.parametrize("kind", ["fixed", "trim"])


@both
def test_acceleration_is_that_of_the_lagrangian(kind: Preload) -> None:
    random = np.random.default_rng(2)
    for _ in range(30):
        arm = random.uniform(1, 5), random.uniform(10, 150), random.uniform(400, 4000)
        theta, rate, base, torque = random.uniform((-0.1, -3, -8, -2), (0.9, 3, 8, 2))
        lever = body(held(arm, kind), base, substeps=1)
        lever._step = 1e-9  # so short that the increment is the derivative
        lever.theta, lever.theta_dot = theta, rate
        lever.advance(torque)
        expected = acceleration(kind, arm, theta, rate, base, torque)
        assert (lever.theta_dot - rate) / 1e-9 == pytest.approx(expected, rel=1e-6, abs=2e-5)


def test_large_motion_is_that_of_solve_ivp() -> None:
    """A second of a ringing, shaken, pushed lever: 1e-5 of its amplitude."""
    arm, time = (1.5, 15.0, 900.0), np.arange(1001) * PERIOD
    lever = body(held(arm, count=1001), 3.0 * np.sin(2 * math.pi * 5.0 * time))
    lever.theta += 0.2

    def derivative(now: float, x: np.ndarray) -> list[float]:
        return [x[1], acceleration("trim", arm, x[0], x[1], 3.0 * math.sin(2 * math.pi * 5.0 * now), 0.4)]

    exact = integrate.solve_ivp(derivative, (0, 1), [lever.theta, 0.0], t_eval=time, rtol=1e-10, atol=1e-12).y
    path = moved(lever, 1001, command=0.4)[:, 0] + TRIM
    assert np.abs(path - exact[0]).max() < 1e-5 * np.ptp(exact[0])


@both
def test_it_rests_at_the_equilibrium_with_the_dynamics_of_the_linearised_lagrangian(kind: Preload) -> None:
    truth = held(kind=kind, count=300)
    rest = truth.rest[0]
    np.testing.assert_allclose(moved(body(truth), 300), [(rest - TRIM, 0.0)] * 300, atol=1e-12)
    assert acceleration(kind, ARM, rest, 0.0) == pytest.approx(0.0, abs=1e-9)
    step = 1e-5
    stiffness, damping = (
        -(acceleration(kind, ARM, rest + a, b) - acceleration(kind, ARM, rest - a, -b)) / (2 * step)
        for a, b in ((step, 0.0), (0.0, step))
    )
    assert truth.dynamics.natural_frequency[0] == pytest.approx(math.sqrt(stiffness) / (2 * math.pi), rel=1e-6)
    assert truth.dynamics.damping_ratio[0] == pytest.approx(damping / (2 * math.sqrt(stiffness)), rel=1e-6)


def test_a_plant_ends_with_its_data() -> None:
    lever = body(held(count=3))
    lever.advance(0.0)
    lever.advance(0.0)
    with pytest.raises(StopIteration):
        lever.advance(0.0)


@both
def test_the_grip_force_is_what_the_arm_does(kind: Preload) -> None:
    """By the arm's side of the equation of motion, from the motion alone; noise and disturbance act on the lever."""
    count = 4000
    time = PERIOD * np.arange(count)
    z_ddot, push = 1.2 * np.sin(2.0 * np.pi * 4.0 * time), 0.5 * np.sin(2.0 * np.pi * 0.7 * time)
    lever, truth = dataclasses.replace(LEVER, lever_friction=0.2), held(kind=kind, count=count)
    moving = body(dataclasses.replace(truth, lever=lever), z_ddot, noise=0.05, lag=2e-3, disturbance=push)
    theta, theta_dot, force = np.empty((3, count))
    for k in range(count):
        theta[k], theta_dot[k], force[k] = moving.theta, moving.theta_dot, moving.grip_force
        if k + 1 < count:
            moving.advance(0.3 * math.sin(2.0 * math.pi * 3.0 * time[k]))
    angle, rate, base = (0.5 * (values[1:] + values[:-1]) for values in (theta, theta_dot, z_ddot))
    length, (m_p, c_p, k_p) = lever.lever_length, ARM
    rest = TRIM if kind == "trim" else lever.arm_preload_angle
    arm = m_p * (length * np.diff(theta_dot) / PERIOD + (base + GRAVITY * (kind == "fixed")) * np.cos(angle))
    arm += length * np.cos(angle) * (c_p * np.cos(angle) * rate + k_p * (np.sin(angle) - math.sin(rest)))
    assert np.abs(force[1:] + arm).max() < 1e-2 * np.abs(arm).max()
