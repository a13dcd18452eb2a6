"""The linear truths against scipy's state spaces: motion, response, modes, noise and motor."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from lever_cdkf.sil.plants.linear_plant import BlackBox, LinearTruth, Physical
from lever_cdkf.sil.plants.truth import Conditions
from scipy import linalg, signal

PERIOD = 1e-3
TRIM = 0.35


def held(kind: type[LinearTruth], values: tuple[float, float, float], count: int = 2) -> LinearTruth:
    return kind(*(np.full(count, value) for value in (*values, TRIM)))


def physical(count: int = 2) -> LinearTruth:
    return held(Physical, (3.2, 60.0, 2100.0), count)


def black_box(count: int = 2) -> LinearTruth:
    return held(BlackBox, (-500.0, -14.0, -2.2), count)


def state_space(truth: LinearTruth) -> signal.StateSpace:
    """From the parameters, with inputs z_ddot and tau_m and output theta - trim."""
    if isinstance(truth, Physical):
        m, c, k = truth.m[0], truth.c[0], truth.k[0]
        return signal.StateSpace([[0, 1], [-k / m, -c / m]], [[0, 0], [1, 1 / m]], [[1, 0]], [[0, 0]])
    assert isinstance(truth, BlackBox)
    return signal.StateSpace([[0, 1], [truth.a21[0], truth.a22[0]]], [[0, 0], [truth.b21[0], 0]], [[1, 0]], [[0, 0]])


@pytest.mark.parametrize("make", [physical, black_box])
def test_motion_is_that_of_lsim(make: Callable[[int], LinearTruth]) -> None:
    """Shaken by noise that is linear between the samples and pushed by a constant torque."""
    count = 3000
    truth = make(count)
    base = np.random.default_rng(1).standard_normal(count)
    body = truth.body(Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    path = [body.theta]
    for _ in range(count - 1):
        body.advance(0.4)
        path.append(body.theta)
    inputs = np.column_stack((base, np.full(count, 0.4)))
    _, expected, _ = signal.lsim(state_space(truth), inputs, np.arange(count) * PERIOD)
    assert np.abs(np.array(path) - TRIM - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("make", [physical, black_box])
def test_dynamics_and_transfer_function_are_those_of_the_state_space(make: Callable[[int], LinearTruth]) -> None:
    truth = make(3)
    system = state_space(truth)
    pole = np.linalg.eigvals(system.A)[0]
    assert truth.dynamics.natural_frequency == pytest.approx(abs(pole) / (2 * math.pi))
    assert truth.dynamics.damping_ratio == pytest.approx(-pole.real / abs(pole))
    frequency = np.array([0.5, 3.0, 9.0])
    response = truth.transfer(np.array([0, 2])).response(frequency)
    for row in response:
        for answer, hertz in zip(row, frequency, strict=True):
            states = np.linalg.solve(2j * math.pi * hertz * np.eye(2) - system.A, system.B[:, 0])
            assert answer == pytest.approx(states[0])


def test_process_noise_has_the_variance_of_the_lyapunov_equation() -> None:
    count, noise = 200_000, 0.05
    truth = physical(count)
    body = truth.body(Conditions(np.zeros(count), PERIOD, noise, 0.0, np.random.default_rng(2)))
    path = np.empty((count - 1, 2))
    for k in range(count - 1):
        body.advance(0.0)
        path[k] = body.theta, body.theta_dot
    system = state_space(truth)
    covariance = linalg.solve_continuous_lyapunov(system.A, -np.diag([0.0, noise**2]))
    correlation_time = -1.0 / np.linalg.eigvals(system.A)[0].real
    uncertainty = math.sqrt(2 * correlation_time / (count * PERIOD))  # relative, of a variance; about 3 %
    assert np.diag(np.cov(path[2000:].T)) == pytest.approx(np.diag(covariance), rel=4 * uncertainty)


def test_the_motor_follows_its_command_with_its_lag_and_the_black_box_does_not_feel_it() -> None:
    for truth, moved in ((physical(20), True), (black_box(20), False)):
        body = truth.body(Conditions(np.zeros(20), PERIOD, 0.0, 2e-3, np.random.default_rng(0)))
        torques = []
        for _ in range(10):
            body.advance(0.5)
            torques.append(body.tau_m)
        assert torques == pytest.approx([0.5 * (1 - math.exp(-k / 2.0)) for k in range(1, 11)])
        assert (body.theta != TRIM) is moved
        assert truth.takes_torque is moved


def test_a_step_of_the_trim_takes_the_rest_position_along() -> None:
    count = 4000
    truth = physical(count)
    truth.trim[1000:] = 0.5  # type: ignore[attr-defined]
    body = truth.body(Conditions(np.zeros(count), PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    for _ in range(count - 1):
        body.advance(0.0)
    assert body.theta == pytest.approx(0.5, abs=1e-6)
