"""The scores against scipy's distributions, Monte Carlo, and curves drawn by hand."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from lever_sil import measures
from lever_sil.study import scores
from lever_sil.study.data import Estimates
from lever_sil.study.matched import Condition, matched
from numpy.typing import NDArray

Array = NDArray[Any]  # of floats


def correlated(rng: np.random.Generator, runs: int, times: int, memory: float) -> Array:
    """Return (runs, times) standard normal values, each correlated by `memory` with the one before."""
    white = rng.standard_normal((runs, times))
    for k in range(1, times):
        white[:, k] = memory * white[:, k - 1] + np.sqrt(1.0 - memory**2) * white[:, k]
    return white


# --- errors and references --------------------------------------------------------------------------------------------


def test_errors_are_those_of_w_and_relative_ones_of_the_dynamics() -> None:
    """Of an arm without a lever, whose frequency goes with √(k/m) and whose damping ratio with c/√(k m)."""
    settings = {"lever_mass": 0.01, "lever_inertia": 0.0, "lever_damping": 0.0, "lever_stiffness": 0.0}
    batch = matched(Condition(settings=settings), 3, 0.5, 1)
    assert batch.truth.p is not None
    at = np.array([10, 400])
    w = np.log(batch.truth.p[:, at] / batch.knowledge.guess)
    wrong = np.array([0.0, 0.2, np.log(1.1)])
    found = scores.errors(batch, Estimates(at, w + wrong, None))
    np.testing.assert_allclose(found[..., :3], np.broadcast_to(wrong, (3, 2, 3)), atol=1e-12)
    np.testing.assert_allclose(found[..., 3], np.sqrt(1.1) - 1.0, rtol=1e-9)
    np.testing.assert_allclose(found[..., 4], np.exp(0.2) / np.sqrt(1.1) - 1.0, rtol=1e-9)


def test_of_a_truth_outside_the_model_only_the_dynamics_are_judged() -> None:
    batch = matched(Condition(), 2, 0.5, 1)
    batch = dataclasses.replace(batch, truth=dataclasses.replace(batch.truth, p=None))
    found = scores.errors(batch, Estimates(np.array([3]), np.zeros((2, 1, 3)), None))
    assert np.isnan(found[..., :3]).all()
    assert np.isfinite(found[..., 3:]).all()


def test_rms_and_ratio_of_numbers_made_by_hand() -> None:
    deviations = np.array([[[3.0, 1.0], [-4.0, 1.0]], [[0.0, -1.0], [5.0, 1.0]]])  # mean squares 12.5, 1
    variances = np.array([[[2.0, 4.0], [4.0, 4.0]], [[1.0, 4.0], [5.5, 4.0]]])  # means 3.125, 4
    np.testing.assert_allclose(scores.ratio(deviations, variances), [2.0, 0.5])
    np.testing.assert_allclose(scores.sigma_ratio(deviations, variances), [0.5, 2.0])


def test_two_estimators_are_told_apart_more_finely_than_one_from_the_bound() -> None:
    rng = np.random.default_rng(4)
    good, other = (correlated(rng, 40, 100, 0.9)[..., None] for _ in range(2))
    worse = good + 0.3 * other
    pair = scores.ratio_spread(worse, np.square(good), seed=1)[0]
    assert scores.ratio(worse, np.square(good))[0] == pytest.approx(np.sqrt(1.09), abs=3.3 * pair)
    assert pair < 0.6 * scores.ratio_spread(worse, np.ones_like(good), seed=1)[0]


def test_spread_of_the_ratio_is_that_of_many_experiments() -> None:
    """40 runs whose errors are correlated in time, and of unlike size: 200 experiments against one's own opinion."""
    rng = np.random.default_rng(3)
    size = np.linspace(0.5, 1.5, 40)[:, None]
    ratios, opinions = [], []
    for experiment in range(200):
        deviations = (size * correlated(rng, 40, 100, 0.98))[..., None]
        variances = np.broadcast_to(size**2, (40, 100))[..., None]
        ratios.append(scores.ratio(deviations, variances)[0])
        opinions.append(scores.ratio_spread(deviations, variances, seed=experiment, draws=300)[0])
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.02)
    assert np.mean(opinions) == pytest.approx(np.std(ratios), rel=0.15)


# --- consistency -----------------------------------------------------------------------------------------------------


def in_band(found: scores.Consistency) -> bool:
    return found.mean_band[0] <= found.mean <= found.mean_band[1]


@pytest.mark.parametrize(("freedom", "memory"), [(2, 1.0), (3, 0.95)])
def test_a_consistent_filter_is_found_so_in_95_of_100_batches_or_more(freedom: int, memory: float) -> None:
    """Exact chi-square, correlated over a tenth of the run or all of it: 600 batches of 20 runs."""
    rng = np.random.default_rng(7)
    normal = np.stack([correlated(rng, 600 * 20, 200, memory) for _ in range(freedom)])
    batches = np.sum(np.square(normal), axis=0).reshape(600, 20, 200)
    found = [scores.consistency(squares, freedom) for squares in batches]
    assert all(one.expected == freedom for one in found)
    share, spread = np.mean([in_band(one) for one in found]), 3.3 * np.sqrt(0.95 * 0.05 / 600)
    assert share > 0.95 - spread
    if memory == 1.0:
        assert share < 0.95 + spread
    inside = [one.inside for one in found]
    assert np.mean(inside) == pytest.approx(0.95, abs=3.3 * np.std(inside) / np.sqrt(600))
    assert np.mean([one.mean for one in found]) == pytest.approx(freedom, rel=0.02)


@pytest.mark.parametrize("claim", [0.8, 1.25])
def test_a_filter_that_lies_about_its_sigma_is_found_out(claim: float) -> None:
    rng = np.random.default_rng(9)
    normal = np.stack([correlated(rng, 40, 400, 0.95) for _ in range(3)], axis=-1)
    covariance = np.broadcast_to(claim**2 * np.eye(3), (40, 400, 3, 3))
    found = scores.consistency(measures.normalised_squares(normal, covariance), 3)
    assert not in_band(found)
    assert found.inside < 0.8
    assert found.mean == pytest.approx(3.0 / claim**2, rel=0.1)
    sigma_ratio = scores.sigma_ratio(normal, np.diagonal(covariance, axis1=-2, axis2=-1))
    np.testing.assert_allclose(sigma_ratio, claim, rtol=0.1)


def test_median_and_worst() -> None:
    assert scores.median_and_worst(np.array([1.0, 4.0, 2.0])) == (2.0, 4.0)
    median, worst = scores.median_and_worst(np.array([1.0, np.nan, 2.0]))
    assert median == 2.0
    assert np.isnan(worst)
    assert np.isnan(scores.median_and_worst(np.array([1.0, np.nan, np.nan]))[0])
