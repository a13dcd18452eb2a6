"""The paper: two claims about its parameter filter as identities, and its experiment.

"Equivalent to recursive least squares in linear cases, in general to a modified Gauss-Newton method" (Aresi, Zanoni,
Masarati). Least squares and the Gauss-Newton step are written here from their textbooks, not from the filter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from lever_cdkf.firmware.config import setting
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.compare import paper, run_cases
from lever_sil.study.compare.cases import Plan, cases
from lever_sil.study.data import Batch, Knowledge, Truth
from python.study.reference_filters import ParameterFilter

SAMPLES, PERIOD = 1001, 1e-3
P = np.array([1.5, -0.7, 0.3])


@dataclass(frozen=True)
class Regression:
    """theta_dot of the next sample is phi . p, with phi = (u_1, u_2, 1) of the inputs: linear in the parameters for
    curvature 0. The state has no influence."""

    curvature: float = 0.0
    preload: str = "trim"

    def step(self, x: Array, p: Array, u: tuple[float | Array, float | Array], trim: float | Array, dt: float) -> Array:
        first = u[0] * (p[0] + self.curvature * p[0] ** 2)
        rate = first + u[1] * p[1] + p[2]
        return np.stack((0.0 * x[0] + 0.0 * rate, 0.0 * x[1] + rate))

    def dynamics(self, p: Array, trim: float | Array) -> Array:
        raise NotImplementedError


def batch(model: Regression, walk: float = 0.0) -> Batch:
    """Return one run: white inputs, theta_dot with noise, theta zero; a first guess of 0 with a standard deviation
    of 2."""
    rng = np.random.default_rng(1)
    u = rng.standard_normal((1, SAMPLES, 2))
    mean = 0.5 * (u[0, 1:] + u[0, :-1])
    x = np.zeros((1, SAMPLES, 2))
    x[0, 1:] = model.step(np.zeros((2, SAMPLES - 1)), P[:, np.newaxis], (mean[:, 0], mean[:, 1]), 0.0, PERIOD).T
    knowledge = Knowledge(
        np.zeros(3), np.full(3, 2.0), np.full(3, walk), positive=False, output_noise=np.full(2, 0.1), process_noise=0.0
    )
    y = x + 0.1 * rng.standard_normal(x.shape)
    truth = Truth(x, np.broadcast_to(P, (1, SAMPLES, 3)), np.ones((1, SAMPLES, 2)))
    return Batch(model, PERIOD, y, u, np.zeros((1, SAMPLES)), knowledge, truth, y, u)


def least_squares(data: Batch, walk: float = 0.0) -> tuple[Array, Array]:
    """Recursive least squares on target = phi . q (Ljung and Soederstrom 1983, eq. 2.18); q (K, 3), P (K, 3, 3)."""
    mean = 0.5 * (data.u[0, 1:] + data.u[0, :-1])
    phi = np.column_stack((mean, np.ones(len(mean))))
    q, covariance = np.zeros((SAMPLES, 3)), np.tile(4.0 * np.eye(3), (SAMPLES, 1, 1))
    for k in range(1, SAMPLES):
        prior = covariance[k - 1] + walk**2 * PERIOD * np.eye(3)
        gain = prior @ phi[k - 1] / (0.1**2 + phi[k - 1] @ prior @ phi[k - 1])
        q[k] = q[k - 1] + gain * (data.y[0, k, 1] - phi[k - 1] @ q[k - 1])
        covariance[k] = prior - np.outer(gain, phi[k - 1] @ prior)
    return q, covariance


def filtered(data: Batch) -> tuple[Array, Array]:
    """Return what Algorithm 1 makes of the run: w in physical units (K, 3), its covariance (K, 3, 3)."""
    recursion = ParameterFilter(data, steps=1)
    p, covariance = np.zeros((SAMPLES, 3)), np.tile(4.0 * np.eye(3), (SAMPLES, 1, 1))
    for k in range(1, SAMPLES):
        recursion.step(k)
        p[k] = data.knowledge.physical(recursion.w)[0]
        covariance[k] = 4.0 * recursion.w_covariance[0]
    return p, covariance


@pytest.mark.parametrize("walk", [0.0, 0.3])
def test_linear_in_its_parameters_the_filter_is_recursive_least_squares(walk: float) -> None:
    """Over a thousand samples, to rounding; with a walk, least squares for parameters that walk."""
    data = batch(Regression(), walk)
    expected, expected_covariance = least_squares(data, walk)
    found, covariance = filtered(data)
    assert np.abs(found - expected).max() < 1e-10
    assert np.abs(covariance - expected_covariance).max() < 1e-10
    assert np.abs(found[-1] - P).max() < 5.0 * np.sqrt(np.diag(covariance[-1])).max()


def test_where_the_identity_ends() -> None:
    """With an output that is quadratic in a parameter they differ, and least squares of the linear model is wrong."""
    data = batch(Regression(curvature=0.1))
    truth, wrong = data.truth.p, least_squares(data)[0]
    assert truth is not None
    found, covariance = filtered(data)
    assert abs(wrong[-1, 0] - truth[0, -1, 0]) > 0.1
    assert abs(found[-1, 0] - truth[0, -1, 0]) < 5.0 * covariance[-1, 0, 0] ** 0.5 < 0.1


def test_one_update_is_a_step_of_a_modified_gauss_newton_method() -> None:
    """The step from the prior that minimises |w - w_prior|^2 / P + |y - g - J (w - w_prior)|^2 / (R + D D^T): J is the
    slope between sigma points, not the derivative, and second differences D count as noise of the output."""
    data = batch(Regression(curvature=0.1))
    knowledge = replace(data.knowledge, guess=np.array([0.5, 0.0, 0.0]))
    data = replace(data, knowledge=knowledge)
    recursion = ParameterFilter(data, steps=1)
    recursion.step(1)
    u, h, sigma = 0.5 * (data.u[0, 0] + data.u[0, 1]), np.sqrt(3.0), 2.0

    def g(p: Array) -> float:
        return float(data.model.step(np.zeros(2), p, (u[0], u[1]), 0.0, PERIOD)[1])

    points = [knowledge.guess + sign * h * sigma * axis for sign in (1.0, -1.0) for axis in np.eye(3)]
    values = np.array([g(each) for each in points]).reshape(2, 3)
    slope = (values[0] - values[1]) / (2.0 * h)  # by w, whose prior is a standard normal
    bend = np.sqrt(h**2 - 1.0) / (2.0 * h**2) * (values[0] + values[1] - 2.0 * g(knowledge.guess))
    expected = g(knowledge.guess) + 0.5 * (values.sum() - 6.0 * g(knowledge.guess)) / h**2
    variance = 0.1**2 + bend @ bend
    normal = np.eye(3) + np.outer(slope, slope) / variance
    step = np.linalg.solve(normal, slope * (data.y[0, 1, 1] - expected) / variance)
    assert np.abs(recursion.w[0] - step).max() < 1e-12
    derivative = sigma * np.array([u[0] * (1.0 + 0.2 * 0.5), u[1], 1.0])
    assert np.abs(slope - derivative).max() < 1e-12, "of a quadratic function the two slopes are equal"
    error = data.y[0, 1, 1] - g(knowledge.guess)
    normal = np.eye(3) + np.outer(derivative, derivative) / 0.1**2
    gauss_newton = np.linalg.solve(normal, derivative * error / 0.1**2)
    assert np.abs(recursion.w[0] - gauss_newton).max() > 1e-3


# --- the experiment --------------------------------------------------------------------------------------------------

SHORT = Plan(seeds=3, duration=8.0)


def experiment(truth: str) -> str:
    return f"paper_lever_{truth}_coarse_rough"


def test_parameters_stay_drift_or_jump_and_estimators_are_told_the_same() -> None:
    batches = {truth: cases()[experiment(truth)].batch(SHORT) for truth in ("constant", "drift", "jump")}
    p = {truth: data.truth.p for truth, data in batches.items() if data.truth.p is not None}
    assert np.ptp(p["constant"], axis=1).max() == 0.0
    assert np.ptp(p["drift"], axis=1).min() > 0.0
    ratio = p["jump"] / p["constant"]
    assert np.allclose(ratio[:, :4000], 1.0)
    assert np.allclose(ratio[:, 4000:], (1.0, 1.3, 1.3))
    walk = [setting(f"{name}_walk").default for name in ("m_p", "c_p", "k_p")]
    assert all(np.allclose(data.knowledge.walk, walk) for data in batches.values())
    noise = batches["constant"].raw_y - batches["constant"].truth.x
    assert np.std(noise, axis=(0, 1)) == pytest.approx(5.0 * np.array([1e-3, 1e-2]), rel=0.02)


def test_the_table_is_that_of_the_runs() -> None:
    """Computed anew from the errors of each run; both kinds of parameter noise are in it."""
    name = experiment("jump")
    results = run_cases.run(run_cases.tasks([name], None, SHORT), jobs=1)
    (rows,) = paper.tables(results).values()
    by_name = {str(row["estimator"]): row for row in rows}
    assert {"dual_fixed", "dual_annealing", "dual_robbins_monro", "joint_annealing", "rls"} <= by_name.keys()
    outcome = results.outcomes[name, "dual_annealing"]
    judged = (outcome.time >= 2.0) & ((outcome.time < 4.0) | (outcome.time >= 5.0))
    error = outcome.relative[:, judged, :3]
    rms = 100.0 * np.sqrt(np.mean(error**2, axis=(1, 2)))
    assert outcome.stated is not None
    inside = np.abs(outcome.errors[:, judged, :3]) <= 2.0 * np.sqrt(outcome.stated[:, judged, :3])
    least = 100.0 * inside.mean(axis=1).min(axis=1)
    row = by_name["dual_annealing"]
    assert row["rms [%]"] == " / ".join(
        f"{each:.0f}" if each >= 10 else f"{each:.1f}" for each in (np.median(rms), rms.max())
    )
    assert str(row["±2σ covers [%]"]).split(" / ")[1] in (f"{least.min():.0f}", f"{least.min():.1f}")
    assert by_name["lms"]["±2σ covers [%]"] is None, "it states no standard deviation"
    assert {row["parameters"] for row in rows} == {"jump"}
