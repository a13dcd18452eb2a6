"""Filter and lever of the float64 oracle against FilterPy, other forms of the same equations, and closed forms."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.native import settings_table
from lever_cdkf.models.linear import Hand
from numpy.typing import NDArray
from oracle import Lever, cdkf
from scipy.integrate import solve_ivp

Array = NDArray[Any]  # of floats
AT_REST = {"arm_preload_angle": 0.3984, "lever_preload_angle": 0.35}  # preload fixed: PILOT's arm holds it at START
SETTINGS = {row.name: row.default for row in settings_table()} | AT_REST
PILOT = np.array([2.5, 42.0, 1500.0])
BOTH = np.array([True, True])


def random_factor(rng: np.random.Generator, size: int, scale: float = 1.0) -> Array:
    return np.linalg.cholesky(scale**2 * (np.eye(size) + 0.3 * np.cov(rng.standard_normal((size, 4 * size)))))


# --- the square-root kernels -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_tria_is_the_cholesky_factor(size: int) -> None:
    matrix = np.random.default_rng(size).standard_normal((size, 3 * size))
    np.testing.assert_allclose(cdkf.tria(matrix), np.linalg.cholesky(matrix @ matrix.T), atol=1e-12)


def test_a_square_has_its_exact_mean_and_variance() -> None:
    """For x² of a Gaussian: mean μ² + σ², variance 4 μ² σ² + 2 σ⁴; central differences with h² = 3 are exact there."""
    points = cdkf.draw(np.array([1.3]), np.array([[0.7]]))
    mean, first, second = cdkf.differences(points**2)
    assert mean[0] == pytest.approx(1.3**2 + 0.7**2)
    assert cdkf.deviations(np.hstack((first, second)))[0] ** 2 == pytest.approx(4 * 1.3**2 * 0.7**2 + 2 * 0.7**4)


# --- the filter, for any model ---------------------------------------------------------------------------------------


def dense_differences(mean: Array, covariance: Array, function: Callable[[Array], Array]) -> tuple[Array, Array, Array]:
    """Mean, covariance and cross-covariance of a function's value, point by point as in Nørgaard et al. (2000)."""
    root, h2, n = np.linalg.cholesky(covariance), 3.0, len(mean)
    centre = function(mean)
    plus = [function(mean + np.sqrt(h2) * root[:, j]) for j in range(n)]
    minus = [function(mean - np.sqrt(h2) * root[:, j]) for j in range(n)]
    value = (h2 - n) / h2 * centre + sum(p + m for p, m in zip(plus, minus, strict=True)) / (2 * h2)
    own = sum(
        np.outer(p - m, p - m) / (4 * h2) + (h2 - 1) / (4 * h2**2) * np.outer(p + m - 2 * centre, p + m - 2 * centre)
        for p, m in zip(plus, minus, strict=True)
    )
    cross = sum(np.outer(root[:, j], plus[j] - minus[j]) / (2 * np.sqrt(h2)) for j in range(n))
    return value, np.asarray(own), np.asarray(cross)


def test_square_root_form_equals_the_form_on_covariances() -> None:
    rng = np.random.default_rng(3)
    process, noise = random_factor(rng, 3, 0.05), random_factor(rng, 2, 0.2)

    def step(x: Array) -> Array:
        return np.array([x[0] + 0.1 * x[1], 0.95 * x[1] - 0.1 * np.sin(x[0]) + 0.05 * x[2] ** 2, 0.99 * x[2]])

    def output(x: Array) -> Array:
        return np.array([x[0] * x[2], np.exp(0.3 * x[1])])

    mean, factor = np.array([0.4, -0.2, 1.0]), random_factor(rng, 3, 0.3)
    dense_mean, dense = mean, factor @ factor.T
    truth = mean + 0.2
    for _ in range(100):
        truth = step(truth) + process @ rng.standard_normal(3)
        y = output(truth) + noise @ rng.standard_normal(2)
        mean, factor = cdkf.predict(mean, factor, step, process)
        expected = cdkf.measure(mean, factor, output, noise)
        mean, factor = cdkf.update(mean, factor, expected, cdkf.gain(factor, expected), y - expected.mean)

        dense_mean, own, _ = dense_differences(dense_mean, dense, step)
        dense = own + process @ process.T
        predicted, own, cross = dense_differences(dense_mean, dense, output)
        innovation_covariance = own + noise @ noise.T
        k = cross @ np.linalg.inv(innovation_covariance)
        dense_mean = dense_mean + k @ (y - predicted)
        dense = dense - k @ innovation_covariance @ k.T
        np.testing.assert_allclose(mean, dense_mean, atol=1e-9)
        np.testing.assert_allclose(factor @ factor.T, dense, atol=1e-10)


# --- the lever -------------------------------------------------------------------------------------------------------


def acceleration(lever: Lever, p: Array, state: Array, u: tuple[float, float], trim: float) -> float:
    """θ̈ from the equation of firmware/THEORY.md, written out."""
    (theta, rate), (m_p, c_p, k_p), (z_ddot, tau_m), g = state, p, u, 9.80665
    length = lever.length
    mu = lever.mass_position * lever.mass + m_p
    inertia = length**2 * (lever.mass_position**2 * lever.mass + m_p) + lever.inertia
    arm, own = np.sin(lever.arm_preload_angle), lever.lever_preload_angle
    if lever.preload == "trim":
        arm, own = np.sin(trim) + g * mu / (k_p * length), trim
    springs = length**2 * k_p * (np.sin(theta) - arm) * np.cos(theta) + lever.stiffness * (theta - own)
    damping = (c_p * length**2 * np.cos(theta) ** 2 + lever.damping) * rate
    return float((tau_m - length * mu * np.cos(theta) * (z_ddot + g) - springs - damping) / inertia)


@pytest.mark.parametrize("preload", ["trim", "fixed"])
def test_step_is_second_order_in_the_equation_of_motion(preload: str) -> None:
    lever = Lever.from_settings(SETTINGS, preload)
    start, u, trim = np.array([0.40, 0.3]), (1.5, 0.4), 0.33

    def rates(_: float, state: Array) -> list[float]:
        return [state[1], acceleration(lever, PILOT, state, u, trim)]

    exact = solve_ivp(rates, (0.0, 0.1), start, rtol=1e-11, atol=1e-12).y[:, -1]

    def error(steps: int) -> float:
        x = start[:, None]
        for _ in range(steps):
            x = lever.step(x, PILOT[:, None], u, trim, 0.1 / steps)
        return float(np.abs(x[:, 0] - exact).max())

    assert error(100) < 2e-4
    assert error(100) / error(200) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("preload", "trim"), [("trim", 0.35), ("trim", -0.4), ("fixed", 0.35)])
def test_dynamics_are_those_of_the_linearised_equation(preload: str, trim: float) -> None:
    lever = dataclasses.replace(Lever.from_settings(SETTINGS, preload), arm_preload_angle=0.5)
    change = 1e-6
    around = [acceleration(lever, PILOT, np.array([trim + sign * change, 0.0]), (0.0, 0.0), trim) for sign in (1, -1)]
    stiffness = -(around[0] - around[1]) / (2 * change)
    still, moving = (acceleration(lever, PILOT, np.array([trim, rate]), (0.0, 0.0), trim) for rate in (0.0, 1.0))
    frequency, ratio = lever.dynamics(PILOT[:, None], trim)[:, 0]
    assert frequency == pytest.approx(np.sqrt(stiffness) / (2 * np.pi), rel=1e-6)
    assert ratio == pytest.approx((still - moving) / (2 * np.sqrt(stiffness)), rel=1e-6)


@pytest.mark.parametrize(("a", "b", "w"), [(13.70, 5.19, 452.3), (13.31, 4.02, 555.4)])
@pytest.mark.parametrize("frequency", [2.0, 3.5, 7.0])
def test_hand_is_what_mayo_has_measured(a: float, b: float, w: float, frequency: float) -> None:
    """Absolute acceleration of his hands over that of the cabin: H = (b s + w) / (s² + a s + w); θ is that of H - 1."""
    hand = Hand.from_settings(SETTINGS, "trim")
    s, trim, dt = 2j * np.pi * frequency, 0.35, 1e-3
    time = np.arange(5000) * dt
    z_ddot, z_dot = np.cos(abs(s) * time), np.sin(abs(s) * time) / abs(s)
    x, theta = np.array([[trim], [0.0]]), np.empty(len(time))
    for k in range(len(time)):
        theta[k] = x[0, 0] - trim
        x = hand.step(
            x, np.array([[w], [a], [a - b]]), (z_ddot[k : k + 2].mean(), 0.0, z_dot[k : k + 2].mean()), trim, dt
        )
    late = time >= 3.0
    measured = 2.0 * (theta * np.exp(-s * time))[late].mean()
    expected = ((b * s + w) / (s**2 + a * s + w) - 1.0) / (s**2 * SETTINGS["lever_length"] * np.cos(trim))
    assert abs(measured - expected) < 0.01 * abs(expected)
