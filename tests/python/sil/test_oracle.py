"""The float64 oracle against other people's filters (FilterPy), other forms of the same equations, and closed forms."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from lever_cdkf.host_tools.native import settings_table
from lever_cdkf.sil.oracle import DualFilter, Lever, Start, cdkf
from lever_cdkf.sil.oracle.detrend import Detrend
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.signal import butter, freqs

Array = NDArray[Any]  # of floats
AT_REST = {"arm_preload_angle": 0.3984, "lever_preload_angle": 0.35}  # preload fixed: PILOT's arm holds it at START
SETTINGS = {row.name: row.default for row in settings_table()} | AT_REST
PILOT = np.array([2.5, 42.0, 1500.0])
BOTH = np.array([True, True])
START = Start(np.array([0.35, 0.0]), np.diag([1e-3, 1e-2]), 0.35)


def random_factor(rng: np.random.Generator, size: int, scale: float = 1.0) -> Array:
    return np.linalg.cholesky(scale**2 * (np.eye(size) + 0.3 * np.cov(rng.standard_normal((size, 4 * size)))))


# --- the square-root kernels -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_tria_is_the_cholesky_factor(size: int) -> None:
    matrix = np.random.default_rng(size).standard_normal((size, 3 * size))
    np.testing.assert_allclose(cdkf.tria(matrix), np.linalg.cholesky(matrix @ matrix.T), atol=1e-12)


def test_tria_of_a_singular_matrix_has_no_negative_diagonal() -> None:
    factor = cdkf.tria(np.array([[1.0, -1.0, 0.0], [-2.0, 2.0, 0.0]]))
    assert (factor.diagonal() >= 0.0).all()
    np.testing.assert_allclose(factor @ factor.T, [[2.0, -4.0], [-4.0, 8.0]], atol=1e-12)


def test_a_square_has_its_exact_mean_and_variance() -> None:
    """For x² of a Gaussian: mean μ² + σ², variance 4 μ² σ² + 2 σ⁴; central differences with h² = 3 are exact there."""
    points = cdkf.draw(np.array([1.3]), np.array([[0.7]]))
    mean, first, second = cdkf.differences(points**2)
    assert mean[0] == pytest.approx(1.3**2 + 0.7**2)
    assert cdkf.deviations(np.hstack((first, second)))[0] ** 2 == pytest.approx(4 * 1.3**2 * 0.7**2 + 2 * 0.7**4)


def test_transform_of_the_parameters_agrees_with_monte_carlo() -> None:
    rng = np.random.default_rng(5)
    lever = Lever.from_settings(SETTINGS, "trim")
    mean, factor = np.array([0.1, -0.2, 0.1]), 0.1 * random_factor(rng, 3)
    points, cloud = cdkf.draw(mean, factor), mean[:, None] + factor @ rng.standard_normal((3, 200_000))
    transformed, first, second = cdkf.differences(lever.dynamics(PILOT[:, None] * np.exp(points), 0.35))
    dynamics = lever.dynamics(PILOT[:, None] * np.exp(cloud), 0.35)
    np.testing.assert_allclose(transformed, dynamics.mean(axis=1), rtol=2e-3)
    np.testing.assert_allclose(cdkf.deviations(np.hstack((first, second))), dynamics.std(axis=1), rtol=2e-2)


# --- the filter, for any model ---------------------------------------------------------------------------------------


def linear_system(rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Transition, output, and the factors of both noises, of a stable system with three states and two outputs."""
    transition = 0.9 * np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return transition, rng.standard_normal((2, 3)), random_factor(rng, 3, 0.1), random_factor(rng, 2, 0.3)


@pytest.mark.parametrize("pattern", ["all", "one missing", "runs missing"])
def test_on_a_linear_system_it_is_the_kalman_filter(pattern: str) -> None:
    rng = np.random.default_rng(11)
    transition, output, process, noise = linear_system(rng)
    reference = KalmanFilter(dim_x=3, dim_z=2)
    reference.F, reference.Q = transition, process @ process.T
    reference.P = 4.0 * np.eye(3)
    mean, factor, truth = np.zeros(3), 2.0 * np.eye(3), rng.standard_normal(3)
    for index in range(300):
        truth = transition @ truth + process @ rng.standard_normal(3)
        y = output @ truth + noise @ rng.standard_normal(2)
        valid = BOTH.copy()
        if pattern == "one missing":
            valid[index % 2] = False
        elif pattern == "runs missing":
            valid[:] = index % 20 > 5
        reference.predict()
        mean, factor = cdkf.predict(mean, factor, lambda x: transition @ x, process)
        if valid.any():
            rows = output[valid]
            reference.update(y[valid, None], R=(noise @ noise.T)[np.ix_(valid, valid)], H=rows)
            expected = cdkf.measure(mean, factor, functools.partial(np.matmul, rows), _part(noise, valid))
            innovation = y[valid] - expected.mean
            nis = cdkf.normalised_square(expected.factor, innovation)
            assert nis == pytest.approx((reference.y.T @ reference.SI @ reference.y).item())
            mean, factor = cdkf.update(mean, factor, expected, cdkf.gain(factor, expected), innovation)
        np.testing.assert_allclose(mean, reference.x.ravel(), atol=1e-9)
        np.testing.assert_allclose(factor @ factor.T, reference.P, atol=1e-9)


def _part(noise: Array, valid: NDArray[np.bool_]) -> Array:
    """Factor of the noise of the valid outputs alone."""
    return cdkf.tria(noise[valid])


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
    step = lambda x: np.array([x[0] + 0.1 * x[1], 0.95 * x[1] - 0.1 * np.sin(x[0]) + 0.05 * x[2] ** 2, 0.99 * x[2]])  # noqa: E731
    output = lambda x: np.array([x[0] * x[2], np.exp(0.3 * x[1])])  # noqa: E731
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
    """θ̈ from the equation of DESIGN section 3, written out."""
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


def test_step_is_stable_for_any_damping() -> None:
    lever = Lever.from_settings(SETTINGS, "trim")
    x = np.array([[0.35], [5.0]])
    for _ in range(1000):
        x = lever.step(x, np.array([[1.0], [1e6], [1500.0]]), (0.0, 0.0), 0.35, 1e-3)
    assert abs(x[1, 0]) < 5.0
    assert abs(x[0, 0] - 0.35) < 0.01


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


def test_lever_refuses_an_unknown_preload() -> None:
    with pytest.raises(ValueError, match='"loose" is neither'):
        Lever.from_settings(SETTINGS, "loose")


# --- state and parameters together -----------------------------------------------------------------------------------


def recorded(count: int, pilot: Array = PILOT) -> dict[str, Array]:
    """Samples of a pilot on a shaking floor, with the motor helping, at 1 kHz."""
    rng = np.random.default_rng(42)
    time = np.arange(count) * 1e-3
    lever, x = Lever.from_settings(SETTINGS, "fixed"), START.state[:, None]
    z_ddot = sum(np.sin(2 * np.pi * f * time + f) for f in (1.7, 2.9, 4.3, 6.1))
    tau_m = 0.3 * sum(np.cos(2 * np.pi * f * time - f) for f in (1.3, 3.7, 5.3))
    states = np.empty((count, 2))
    for k in range(count):
        if k:
            middle = (float(z_ddot[k] + z_ddot[k - 1]) / 2, float(tau_m[k] + tau_m[k - 1]) / 2)
            x = lever.step(x, pilot[:, None], middle, START.trim, 1e-3)
            x[1] += SETTINGS["theta_dot_process_noise"] * np.sqrt(1e-3) * rng.standard_normal()
        states[k] = x[:, 0]
    y = states + rng.standard_normal((count, 2)) * [SETTINGS["theta_noise"], SETTINGS["theta_dot_noise"]]
    return {"time": time, "y": y, "z_ddot": np.asarray(z_ddot), "tau_m": np.asarray(tau_m)}


def start_of(samples: dict[str, Array]) -> Start:
    inputs = (float(samples["z_ddot"][0]), float(samples["tau_m"][0]))
    return dataclasses.replace(START, state=samples["y"][0], input=inputs)


def feed(dual: DualFilter, samples: dict[str, Array], first: int, last: int, valid: NDArray[np.bool_] = BOTH) -> None:
    for k in range(first, last):
        dual.step(samples["time"][k], samples["y"][k], valid, (samples["z_ddot"][k], samples["tau_m"][k]))


def joint_factor(dual: DualFilter) -> Array:
    """Factor of the belief about [w; x] as a whole."""
    return np.block([[dual.w_factor, np.zeros((3, 2))], [dual.v @ dual.w_factor, dual.x_factor]])


def process_covariance(t: float) -> Array:
    """What a step of t [s] adds to [w; x]: random walks of w, and a random walk of θ̇ with its integral in θ."""
    covariance = np.diag([*(SETTINGS[f"{name}_walk"] ** 2 * t for name in ("m_p", "c_p", "k_p")), 0.0, 0.0])
    power = SETTINGS["theta_dot_process_noise"] ** 2
    covariance[3:, 3:] = power * np.array([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
    return covariance


def test_in_parts_it_is_the_joint_filter() -> None:
    """The dual filter with its dx/dw, against one plain CDKF on z = [w; x] that knows of no parts.

    What a walk of w takes from the correlation of x and w, the parts forget and the whole keeps.
    """
    samples = recorded(1500, PILOT * [1.2, 0.8, 1.1])
    dual = DualFilter(SETTINGS, start_of(samples), "fixed", adaptation="fixed")
    dual.cap = np.full(3, np.inf)
    z, factor = np.concatenate((dual.w, dual.x)), joint_factor(dual)
    for k in range(1, 1500):
        u = tuple(0.5 * float(samples[name][k] + samples[name][k - 1]) for name in ("z_ddot", "tau_m"))

        def step(z: Array, u: tuple[float, ...] = u) -> Array:
            p = PILOT[:, None] * np.exp(z[:3])
            return np.concatenate((z[:3], dual.lever.step(z[3:], p, (u[0], u[1]), dual.trim, 1e-3)))

        z, first, second = cdkf.differences(step(cdkf.draw(z, factor)))
        factor = cdkf.tria(np.hstack((first, second, np.linalg.cholesky(process_covariance(1e-3)))))
        expected = cdkf.measure(z, factor, lambda z: z[3:], dual.output_noise)
        innovation = samples["y"][k] - expected.mean
        z, factor = cdkf.update(z, factor, expected, cdkf.gain(factor, expected), innovation)

        feed(dual, samples, k, k + 1)
        assert (np.abs(np.concatenate((dual.w, dual.x)) - z) < 5e-2 * cdkf.deviations(factor)).all()
        assert dual.nis == pytest.approx(cdkf.normalised_square(expected.factor, innovation), rel=2e-2, abs=2e-2)
    assert (np.abs(joint_factor(dual) - factor) < 5e-2 * cdkf.deviations(factor)[:, None]).all()


def test_agrees_with_the_unscented_filter_of_filterpy() -> None:
    """The same sigma points, weighted by Julier and Uhlmann: close, as both are right to second order."""
    settings = SETTINGS | {f"{name}_sigma": 0.15 for name in ("m_p", "c_p", "k_p")}
    samples = recorded(2500, PILOT * [1.1, 0.9, 1.1])
    dual = DualFilter(settings, start_of(samples), "fixed", adaptation="fixed")
    middle = [(0.0, 0.0)]

    def step(z: Array, dt: float) -> Array:
        p = (PILOT * np.exp(z[:3]))[:, None]
        return np.concatenate((z[:3], dual.lever.step(z[3:, None], p, middle[0], dual.trim, dt)[:, 0]))

    points = MerweScaledSigmaPoints(5, alpha=1.0, beta=0.0, kappa=-2.0)
    reference = UnscentedKalmanFilter(5, 2, 1e-3, lambda z: z[3:], step, points)
    reference.x = np.concatenate((dual.w, dual.x))
    reference.P = joint_factor(dual) @ joint_factor(dual).T
    reference.Q = process_covariance(1e-3)
    reference.R = dual.output_noise @ dual.output_noise.T
    for k in range(1, 2500):
        base, torque = (0.5 * float(samples[name][k] + samples[name][k - 1]) for name in ("z_ddot", "tau_m"))
        middle[0] = (base, torque)
        reference.predict()
        reference.update(samples["y"][k])
        feed(dual, samples, k, k + 1)
    sigma = cdkf.deviations(joint_factor(dual))
    assert (np.abs(np.concatenate((dual.w, dual.x)) - reference.x) < 0.1 * sigma).all()
    np.testing.assert_allclose(sigma, np.sqrt(reference.P.diagonal()), rtol=0.01)


def test_finds_another_pilot_within_its_own_uncertainty() -> None:
    pilot = PILOT * [1.2, 0.7, 0.85]
    samples = recorded(8000, pilot)
    dual = DualFilter(SETTINGS, start_of(samples), "fixed")
    feed(dual, samples, 1, 8000)
    estimate, sigma = dual.parameters()
    assert (np.abs(estimate - pilot) < 3.0 * sigma).all()
    assert (sigma < 0.1 * pilot).all()


def test_coasting_moves_with_the_model_and_grows_uncertain() -> None:
    samples = recorded(1200)
    dual = DualFilter(SETTINGS, start_of(samples), "fixed")
    feed(dual, samples, 1, 1000)
    known = np.concatenate((cdkf.deviations(dual.w_factor), dual.state_deviations()))
    w, x = dual.w.copy(), dual.x[:, None]
    for k in range(1000, 1200):
        middle = tuple(0.5 * float(samples[name][k] + samples[name][k - 1]) for name in ("z_ddot", "tau_m"))
        x = dual.lever.step(x, PILOT[:, None] * np.exp(w[:, None]), (middle[0], middle[1]), dual.trim, 1e-3)
        feed(dual, samples, k, k + 1, ~BOTH)
        assert dual.nis == 0.0
    np.testing.assert_array_equal(dual.w, w)
    assert (np.abs(dual.x - x[:, 0]) < 0.05 * dual.state_deviations()).all()
    assert (np.concatenate((cdkf.deviations(dual.w_factor), dual.state_deviations())) > known).all()


def test_a_gap_is_predicted_through_in_steps_of_a_sample_period() -> None:
    samples = recorded(12)
    samples["z_ddot"][:] = samples["z_ddot"][0]
    samples["tau_m"][:] = samples["tau_m"][0]
    bridged, stepped = (DualFilter(SETTINGS, start_of(samples), "fixed") for _ in range(2))
    feed(bridged, samples, 10, 11, ~BOTH)
    feed(stepped, samples, 1, 11, ~BOTH)
    np.testing.assert_allclose(bridged.x, stepped.x, atol=1e-9)
    np.testing.assert_allclose(joint_factor(bridged), joint_factor(stepped), atol=1e-9)


# --- the adaptations -------------------------------------------------------------------------------------------------


def test_a_fixed_walk_stays() -> None:
    samples = recorded(300)
    dual = DualFilter(SETTINGS, start_of(samples), "fixed", adaptation="fixed")
    feed(dual, samples, 1, 300)
    np.testing.assert_array_equal(dual.walk, [SETTINGS[f"{name}_walk"] ** 2 for name in ("m_p", "c_p", "k_p")])


def test_annealing_falls_exponentially_to_the_floor() -> None:
    samples = recorded(1000)
    settings = SETTINGS | {"annealing_time": 0.5, "excitation_least": 0.0, "walk_ceiling": 10.0}
    dual = DualFilter(settings, start_of(samples), "fixed", adaptation="annealing")
    np.testing.assert_allclose(dual.walk, dual.ceiling)
    feed(dual, samples, 1, 501)
    np.testing.assert_allclose(dual.walk, np.exp(-1.0) * dual.ceiling, rtol=1e-9)
    settings["annealing_time"] = 0.01
    feed(dual, samples, 501, 1000)
    np.testing.assert_array_equal(dual.walk, dual.floor)


def test_robbins_monro_stays_between_floor_and_ceiling_and_uses_the_room() -> None:
    samples = recorded(3000, PILOT * [1.5, 0.5, 1.6])
    dual = DualFilter(SETTINGS | {"walk_ceiling": 3.0}, start_of(samples), "fixed", "robbins_monro")
    seen = []
    for k in range(1, 3000):
        feed(dual, samples, k, k + 1)
        seen.append(dual.walk / dual.floor)
    assert np.min(seen) >= 1.0
    assert 2.0 < np.max(seen) <= 9.0 * (1.0 + 1e-12)


def test_without_motion_the_walk_is_at_its_floor_and_the_uncertainty_capped() -> None:
    still = {"time": np.arange(4000) * 1e-3, "y": np.tile([0.35, 0.0], (4000, 1))}
    still |= {"z_ddot": np.zeros(4000), "tau_m": np.zeros(4000)}
    walk = {f"{name}_walk": 0.5 for name in ("m_p", "c_p", "k_p")}
    dual = DualFilter(SETTINGS | walk, start_of(still), "fixed")
    feed(dual, still, 1, 4000)
    np.testing.assert_array_equal(dual.walk, dual.floor)
    assert (cdkf.deviations(dual.w_factor) <= dual.cap * (1.0 + 1e-9)).all()


def test_parameters_stay_in_their_bounds() -> None:
    samples = recorded(4000, PILOT * [1.0, 1.0, 1.8])
    bounds = np.array([[1.0, 5.0], [10.0, 100.0], [1000.0, 1600.0]])
    dual = DualFilter(SETTINGS, start_of(samples), bounds=bounds)
    seen = []
    for k in range(1, 4000):
        feed(dual, samples, k, k + 1)
        seen.append(dual.parameters()[0])
    assert (np.min(seen, axis=0) >= bounds[:, 0] * (1 - 1e-12)).all()
    assert (np.max(seen, axis=0) <= bounds[:, 1] * (1 + 1e-12)).all()
    assert np.max(seen, axis=0)[2] == pytest.approx(1600.0)


# --- trim ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [0.1, 1.0, 4.0])
def test_detrending_is_a_butterworth_high_pass(frequency: float) -> None:
    time = np.arange(0.0, 60.0, 1e-3)
    detrend = Detrend()
    out = np.array([detrend.step(value, 1.0, 1e-3) for value in np.sin(2 * np.pi * frequency * time).tolist()])
    late = time >= 50.0
    wave = np.exp(-2j * np.pi * frequency * time[late])
    gain = (out[late] * wave).mean() / (np.sin(2 * np.pi * frequency * time[late]) * wave).mean()
    numerator, denominator = butter(2, 2 * np.pi, "highpass", analog=True)
    assert gain == pytest.approx(freqs(numerator, denominator, [2 * np.pi * frequency])[1][0], abs=0.01)


def test_a_level_follows_a_ramp_without_lag() -> None:
    detrend = Detrend()
    for k in range(5000):
        deviation = detrend.step(0.1 * k * 1e-3, 1.0, 1e-3)
    assert deviation == pytest.approx(0.0, abs=2e-4)


def test_a_new_trim_teaches_nothing() -> None:
    """The whole recording moved by an angle that rises slowly: the parameters hardly notice."""
    samples = recorded(12000, PILOT * [1.2, 0.8, 1.1])
    moved = samples | {"y": samples["y"].copy()}
    still, carried = (DualFilter(SETTINGS, start_of(samples)) for _ in range(2))
    angle = 0.05 * np.clip((samples["time"] - 5.0) / 4.0, 0.0, 1.0)
    moved["y"][:, 0] += angle
    moved["y"][:, 1] += np.gradient(angle, 1e-3)
    feed(still, samples, 1, 12000)
    feed(carried, moved, 1, 12000)
    assert (np.abs(still.w - carried.w) < 2.0 * cdkf.deviations(still.w_factor)).all()
    assert carried.trim - still.trim == pytest.approx(0.05, abs=1e-3)


def test_dual_refuses_an_unknown_adaptation() -> None:
    with pytest.raises(ValueError, match='"magic" is none of'):
        DualFilter(SETTINGS, START, adaptation="magic")
