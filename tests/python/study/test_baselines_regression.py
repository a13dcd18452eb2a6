"""The models as linear regressions, least squares with forgetting and LMS, against numpy's and scipy's solutions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.models.linear import LinearBlackBox, LinearPhysical
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.baselines.balance import Ratios, Same
from lever_sil.study.baselines.lms import Nlms
from lever_sil.study.baselines.regression import Equations, equations
from lever_sil.study.baselines.rls import Rls
from python.study.baseline_runs import Plan, lever, resting_angle, simulate
from scipy.signal import freqs
from scipy.stats import chi2

QUIET: dict[str, Any] = {"output_noise": (1e-9, 1e-9), "process_noise": 0.0, "walk": (0.0, 0.0, 0.0)}


def black_box(preload: str = "trim") -> Plan:
    """Return natural frequency 3.6 Hz, damping ratio 0.3."""
    guess, sigma, walk = (-512.0, -13.6, 1.0), (150.0, 5.0, 0.3), (5.0, 0.2, 0.01)
    model = LinearBlackBox(0.1, preload)
    return Plan(model, 3, 4.0, guess=guess, sigma=sigma, walk=walk, positive=False, start=(0.1, 0.0))


def physical(preload: str = "trim") -> Plan:
    return Plan(LinearPhysical(0.1, preload), 3, 4.0, torque=3.0, guess=(3.0, 40.0, 1500.0), start=(0.1, 0.0))


def on_lever(preload: str) -> Plan:
    of = lever(preload)
    return Plan(of, 3, 4.0, start=(0.0 if preload == "trim" else resting_angle(of), 0.0))


PLANS = {
    f"{name}-{preload}": plan(preload)
    for name, plan in (("lever", on_lever), ("physical", physical), ("black_box", black_box))
    for preload in ("trim", "fixed")
}


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
@pytest.mark.parametrize("corner", [0.0, 1.0])
def test_the_true_parameters_solve_the_equations(plan: Plan, corner: float) -> None:
    batch = simulate(replace(plan, **QUIET))
    data = equations(batch, 0.02, corner)
    assert batch.truth.p is not None
    q = data.coefficients.of_parameters(batch.truth.p[:, 0])
    moved = data.target - (data.regressors @ data.coefficients.of_parameters(batch.knowledge.guess))
    missed = data.target - (data.regressors @ q[:, :, np.newaxis])[:, :, 0]
    assert np.abs(missed).max() < 2e-3 * np.abs(moved).max()
    np.testing.assert_array_equal(np.diff(data.ends), 20)
    assert data.period == pytest.approx(0.02)


@pytest.mark.parametrize("coefficients", [Ratios(0.08, 0.2), Ratios(0.0, 1.0), Same()])
def test_coefficients_go_to_parameters_and_back(coefficients: Ratios | Same) -> None:
    p = np.array([[2.5, 42.0, 1500.0], [1.0, 10.0, 300.0]])
    q = coefficients.of_parameters(p)
    np.testing.assert_allclose(coefficients.parameters(q), p, rtol=1e-12)
    change = 1e-6 * np.diag(q[0])
    around = (coefficients.parameters(q[0] + change) - coefficients.parameters(q[0] - change)).T / 2e-6 / q[0]
    np.testing.assert_allclose(coefficients.slope(q)[0], around, rtol=1e-6, atol=1e-6 * np.abs(around).max())


@pytest.mark.parametrize("window", [0.001, 0.004, 0.02])
def test_the_noise_of_an_equation_is_as_said(window: float) -> None:
    """Of a rate that is a random walk measured with noise; 95 % band, with half the freedom as neighbours overlap."""
    rng = np.random.default_rng(3)
    batch = simulate(replace(black_box(), runs=1, duration=0.01))
    shape = (40, 5000)
    known = replace(batch.knowledge, output_noise=np.array([1e-3, 0.01]), process_noise=0.3)
    y = np.zeros((*shape, 2))
    y[:, :, 1] = np.cumsum(0.3 * np.sqrt(1e-3) * rng.standard_normal(shape), axis=1)
    y[:, :, 1] += 0.01 * rng.standard_normal(shape)
    data = equations(replace(batch, y=y, u=y, trim=np.zeros(shape), knowledge=known), window, 0.0)
    freedom = data.target.size / 2.0
    low, high = chi2.ppf([0.025, 0.975], freedom) / freedom
    assert low < (data.target**2).mean() / data.variance < high


def test_slow_things_are_passed_over_as_by_a_first_order_high_pass() -> None:
    batch = simulate(replace(black_box(), runs=1, duration=0.01))
    time = np.arange(20_000) * 1e-3
    for frequency in (0.1, 1.0, 4.0):
        y = np.stack((np.sin(2 * np.pi * frequency * time), np.zeros_like(time)), axis=1)[np.newaxis]
        wave = replace(batch, y=y, u=y, trim=np.zeros((1, len(time))))
        seen = [equations(wave, 0.02, corner).regressors[0, 500:, 0] for corner in (0.0, 1.0)]
        gain = np.abs(freqs([1.0, 0.0], [1.0, 2 * np.pi], [2 * np.pi * frequency])[1][0])
        assert seen[1].std() / seen[0].std() == pytest.approx(gain, rel=0.05)


# --- least squares ---------------------------------------------------------------------------------------------------


def least_squares(
    data: Equations, run: int, prior: tuple[Array, Array], forget: float, regularised: bool
) -> tuple[Array, Array]:
    """q and its covariance by numpy: rows weighted by age, the first guess the oldest of them, or of no age."""
    count = data.target.shape[1]
    weight = np.sqrt(forget ** np.arange(count - 1, -1, -1) / data.variance)[:, np.newaxis]
    root = np.linalg.cholesky(np.linalg.inv(prior[1])).T * (1.0 if regularised else np.sqrt(forget**count))
    rows = np.concatenate((root, weight * data.regressors[run]))
    right = np.concatenate((root @ prior[0], weight[:, 0] * data.target[run]))
    return np.linalg.lstsq(rows, right)[0], np.linalg.inv(rows.T @ rows)


@pytest.mark.parametrize("regularised", [False, True])
@pytest.mark.parametrize("name", ["black_box-trim", "lever-trim", "lever-fixed"])
def test_rls_is_weighted_least_squares(name: str, regularised: bool) -> None:
    batch = simulate(PLANS[name])
    known, rls = batch.knowledge, Rls(0.01, 2.0, regularised=regularised)
    data = equations(batch, rls.window, rls.corner)
    estimates = rls(batch, np.array([batch.samples - 1]))
    assert estimates.covariance is not None
    for run in range(batch.runs):
        q, covariance = least_squares(data, run, data.first_guess(known), np.exp(-0.01 / 2.0), regularised)
        w = known.scaled(data.coefficients.parameters(q))
        np.testing.assert_allclose(estimates.w[run, 0], w, atol=1e-8)
        change = 1e-6 * np.diag(q)
        around = [known.scaled(data.coefficients.parameters(q + sign * change)) for sign in (1, -1)]
        slope = (around[0] - around[1]).T / (2e-6 * q)
        np.testing.assert_allclose(estimates.covariance[run, 0], slope @ covariance @ slope.T, rtol=1e-5)
    assert np.abs(estimates.w).max() > 0.1


def test_first_guess_is_what_is_known() -> None:
    """The covariance of q against that of many draws of p."""
    batch = simulate(replace(on_lever("trim"), runs=1, duration=0.01, sigma=(0.02, 0.03, 0.04)))
    data = equations(batch, 0.001, 0.0)
    q, covariance = data.first_guess(batch.knowledge)
    draws = np.random.default_rng(5).standard_normal((20_000, 3)) * batch.knowledge.sigma_w
    drawn = data.coefficients.of_parameters(batch.knowledge.physical(draws))
    np.testing.assert_allclose(drawn.mean(axis=0), q, rtol=2e-3)
    np.testing.assert_allclose(np.cov(drawn.T), covariance, rtol=0.05)


def test_before_its_first_equation_of_two_windows_rls_has_only_the_guess() -> None:
    batch = simulate(PLANS["lever-trim"])
    found = Rls(0.02)(batch, np.array([0, 38, 39]))
    np.testing.assert_array_equal(found.w[:, :2], 0.0)
    assert found.covariance is not None
    np.testing.assert_allclose(found.covariance[0, 0], np.diag(batch.knowledge.sigma**2), atol=1e-12)
    assert (Rls(0.02, corner=0.0)(batch, np.array([39])).w != 0.0).all()


def test_parameters_that_mean_no_pilot_are_not_reported() -> None:
    """A coefficient below zero has no logarithm; the last estimate that had one stands, with its covariance."""
    batch = simulate(PLANS["lever-trim"])
    data = equations(batch, 0.02, 0.0)
    q, covariance = data.first_guess(batch.knowledge)
    path = np.tile(q, (1, len(data.ends) + 1, 1))
    path[0, 1] = 1.1 * q
    path[0, 2, 0] = -1.0
    path[0, 3] = np.nan
    spread = np.tile(covariance, (1, len(data.ends) + 1, 1, 1)) * np.arange(len(data.ends) + 1)[:, None, None]
    estimates = data.estimates(data.ends[:4], batch.knowledge, path, spread)
    assert estimates.covariance is not None
    assert (estimates.w[0, 0] != 0.0).any()
    np.testing.assert_array_equal(estimates.w[0, 1], estimates.w[0, 0])
    np.testing.assert_array_equal(estimates.covariance[0, 1], estimates.covariance[0, 0])
    assert np.isnan(estimates.w[0, 2]).all()
    np.testing.assert_allclose(estimates.w[0, 3], 0.0, atol=1e-12)


# --- LMS -------------------------------------------------------------------------------------------------------------


def test_lms_converges_to_the_wiener_solution() -> None:
    """That of the equations divided by their norm, which is what normalising minimises, here over 15 s."""
    batch = simulate(replace(black_box(), runs=4, duration=30.0, walk=(0.0, 0.0, 0.0)))
    lms = Nlms(0.01, 0.2)
    data = equations(batch, lms.window, lms.corner)
    late = slice(len(data.ends) // 2, None)
    w = lms(batch, data.ends[late]).w
    for run in range(batch.runs):
        phi, target = data.regressors[run, late], data.target[run, late]
        weight = 1.0 / np.sqrt(data.variance + ((phi * batch.knowledge.sigma) ** 2).sum(axis=1))
        wiener = np.linalg.lstsq(weight[:, np.newaxis] * phi, weight * target)[0]
        np.testing.assert_allclose(w[run].mean(axis=0), batch.knowledge.scaled(wiener), atol=0.1)
    assert np.abs(w[:, -1]).max() > 0.5
