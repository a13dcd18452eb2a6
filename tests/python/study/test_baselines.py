"""What is true of each baseline: it finds the parameters, from the past alone, run by run, without the truth."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from lever_cdkf.models.linear import LinearBlackBox, LinearPhysical
from lever_sil.study.baselines import BASELINES, Baseline
from lever_sil.study.data import Batch
from python.study.baseline_runs import Plan, lever, resting_angle, simulate

NEARLY_CONSTANT: dict[str, Any] = {
    "period": 4e-3,
    "process_noise": 1e-3,
    "output_noise": (1e-5, 1e-4),
    "walk": (1e-3, 1e-3, 1e-3),
}
SIGNED: dict[str, Any] = {"guess": (-512.0, -13.6, 1.0), "sigma": (100.0, 4.0, 0.2), "positive": False}
PLANS = {
    "lever-trim": Plan(lever("trim"), torque=1.0, **NEARLY_CONSTANT),
    "lever-fixed": Plan(lever("fixed"), torque=1.0, start=(resting_angle(lever("fixed")), 0.0), **NEARLY_CONSTANT),
    "physical": Plan(LinearPhysical(), torque=3.0, **NEARLY_CONSTANT),
    "black_box": Plan(LinearBlackBox(), **(NEARLY_CONSTANT | SIGNED | {"walk": (0.5, 0.02, 1e-3)})),
}
EVERY = pytest.mark.parametrize("baseline", BASELINES.values(), ids=BASELINES)


@cache
def recorded(plan: str, runs: int, duration: float) -> Batch:
    """With the truth cut off."""
    return replace(simulated(plan, runs, duration), truth=None)  # type: ignore[arg-type]


@cache
def simulated(plan: str, runs: int, duration: float) -> Batch:
    return simulate(replace(PLANS[plan], runs=runs, duration=duration))


@pytest.mark.parametrize("plan", PLANS)
@EVERY
def test_finds_parameters_that_hardly_move(baseline: Baseline, plan: str) -> None:
    """To 0.02 of them (of what is not known of the black box's: 0.06)."""
    batch, p = recorded(plan, 3, 9.0), simulated(plan, 3, 9.0).truth.p
    assert p is not None
    last = batch.samples - 1
    w = baseline.run(batch, np.array([0, last])).w
    truth = batch.knowledge.scaled(p[:, last])
    np.testing.assert_array_equal(w[:, 0], 0.0)
    np.testing.assert_allclose(w[:, 1], truth, atol=0.02 if batch.knowledge.positive else 0.06)
    assert np.abs(truth).max() > 0.1


@EVERY
def test_learns_from_the_past_alone_whenever_it_is_asked(baseline: Baseline) -> None:
    batch = recorded("lever-trim", 1, 1.5)
    early = replace(batch, y=batch.y[:, :200], u=batch.u[:, :200], trim=batch.trim[:, :200])
    often, seldom = baseline.run(early, np.arange(200)), baseline.run(batch, np.array([60, 199]))
    np.testing.assert_array_equal(often.at, np.arange(200))
    np.testing.assert_array_equal(often.w[:, [60, 199]], seldom.w)
    assert seldom.w[:, 1].all()
    if often.covariance is not None:
        assert seldom.covariance is not None
        np.testing.assert_array_equal(often.covariance[:, [60, 199]], seldom.covariance)
        np.testing.assert_allclose(often.covariance[0, 0], np.diag(batch.knowledge.sigma**2), atol=1e-12)
        assert (np.linalg.eigvalsh(seldom.covariance) > 0.0).all()


@EVERY
def test_a_run_that_breaks_down_is_nan_and_the_others_do_not_notice(baseline: Baseline) -> None:
    batch = recorded("lever-trim", 3, 5.0)
    short = replace(batch, y=batch.y[:, :300].copy(), u=batch.u[:, :300], trim=batch.trim[:, :300])
    at = np.array([90, 150, 299])
    expected = baseline.run(short, at)
    short.y[1, 150:] = np.nan
    estimates = baseline.run(short, at)
    np.testing.assert_array_equal(estimates.w[[0, 2]], expected.w[[0, 2]])
    np.testing.assert_array_equal(estimates.w[1, 0], expected.w[1, 0])
    assert np.isnan(estimates.w[1, 2]).all()
    if estimates.covariance is not None:
        broken = np.isnan(estimates.w[1]).any(axis=1)
        np.testing.assert_array_equal(np.isnan(estimates.covariance[1]).all(axis=(1, 2)), broken)
