"""The reference of the Kalman-type baselines, against FilterPy's plain filters where those are exact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.data import Batch
from python.study.baseline_runs import PERIOD, Plan, lever, simulate
from python.study.reference_filters import (
    DualEkf,
    JointEkf,
    JointUkf,
    ParameterFilter,
    UnscentedTransform,
    factor,
    follow,
)

SETTLE, STIFFNESS = 12.0, 500.0


@dataclass(frozen=True)
class Driven:
    """A known oscillator driven through unknown gains, p0 z_ddot + p1 tau_m + p2: linear in states and parameters."""

    preload: str = "fixed"

    def step(self, x: Array, p: Array, u: tuple[Array, Array], trim: Array, dt: float) -> Array:
        drive = p[0] * u[0] + p[1] * u[1] + p[2]
        return np.array((x[0] + dt * x[1], x[1] + dt * (drive - STIFFNESS * x[0] - SETTLE * x[1])))

    def dynamics(self, p: Array, trim: Array) -> Array:
        return np.zeros((2, *p.shape[1:]))


@dataclass(frozen=True)
class Curved:
    """A rate that grows by the square of a parameter."""

    preload: str = "fixed"

    def step(self, x: Array, p: Array, u: tuple[Array, Array], trim: Array, dt: float) -> Array:
        return np.array((x[0] + 0.0 * p[0], x[1] + dt * p[0] ** 2))

    def dynamics(self, p: Array, trim: Array) -> Array:
        return np.zeros((2, *p.shape[1:]))


def driven(**changes: Any) -> Batch:
    usual: dict[str, Any] = {"model": Driven(), "runs": 2, "duration": 2.0, "positive": False}
    gains = {"guess": (1.0, 2.0, 0.5), "sigma": (0.3, 0.5, 0.2), "walk": (0.05, 0.1, 0.02)}
    return simulate(Plan(**(usual | gains | changes)))


def inputs(batch: Batch, run: int, k: int) -> Array:
    """Return what multiplies p in the motion from sample k to k + 1."""
    return np.array((*(0.5 * (batch.u[run, k] + batch.u[run, k + 1])), 1.0))


def plain_filter(batch: Batch, run: int, size: int) -> Any:
    """FilterPy's Kalman filter of [w; x], size 5, or of x alone, size 2, at sample 0."""
    known = batch.knowledge
    kf = KalmanFilter(size, 2)
    kf.x = np.concatenate((np.zeros(3), batch.y[run, 0]))[-size:]
    kf.R = np.diag(known.output_noise**2)
    kf.P = np.diag([1.0, 1.0, 1.0, *known.output_noise**2])[-size:, -size:]
    kf.Q = np.diag([*(known.walk / known.sigma) ** 2 * PERIOD, 0.0, 0.0])[-size:, -size:]
    kf.Q[-2:, -2:] = known.process_covariance(PERIOD)
    kf.H = np.eye(5)[3:, -size:]
    kf.F = np.eye(size)
    kf.F[-2:, -2:] = [[1.0, PERIOD], [-PERIOD * STIFFNESS, 1.0 - PERIOD * SETTLE]]
    kf.B = np.eye(size)[:, -1:] * PERIOD
    return kf


def test_dual_ekf_with_known_parameters_is_a_kalman_filter_and_its_derivative_that_of_one() -> None:
    """The Kalman filter's estimate is linear in the parameters here, so its difference is its derivative."""
    sigma = np.array([1e-6, 1e-6, 1e-6])
    batch = driven(runs=1, sigma=tuple(sigma), walk=(0.0, 0.0, 0.0))
    dual = DualEkf(batch)
    filters = [plain_filter(batch, 0, 2) for _ in range(4)]
    shifts = np.concatenate((np.zeros((1, 3)), np.eye(3)))
    for k in range(1, batch.samples):
        dual.step(k)
        for kf, shift in zip(filters, shifts, strict=True):
            kf.predict(u=inputs(batch, 0, k - 1)[np.newaxis] @ (batch.knowledge.guess + shift))
            kf.update(batch.y[0, k])
        np.testing.assert_allclose(dual.x[0], filters[0].x, atol=1e-8)
    slopes = np.stack([kf.x - filters[0].x for kf in filters[1:]], axis=1)
    np.testing.assert_allclose(dual.derivative[0] / sigma, slopes, atol=1e-4 * np.abs(slopes).max())
    np.testing.assert_allclose(dual.x_covariance[0], filters[0].P, rtol=1e-8)


def test_dual_ekf_knows_constant_parameters_as_well_as_the_kalman_filter_of_both() -> None:
    """Friedland (1969): the covariance is the same exactly; the estimate is nearly, as the state does not follow w."""
    batch = driven(walk=(0.0, 0.0, 0.0))
    dual, joint = DualEkf(batch), JointEkf(batch)
    for k in range(1, batch.samples):
        dual.step(k)
        joint.step(k)
        np.testing.assert_allclose(dual.w_covariance, joint.w_covariance, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(dual.innovation_covariance, joint.innovation_covariance, rtol=1e-6)
    sigma = np.sqrt(np.einsum("bii->bi", joint.w_covariance))
    assert (np.abs(dual.w - joint.w) < 0.3 * sigma).all()
    assert (sigma < 0.3).all()


@pytest.mark.parametrize("preload", ["trim", "fixed"])
def test_joint_ekf_is_the_extended_filter_of_filterpy(preload: str) -> None:
    """Derivatives there are by complex steps."""
    batch = simulate(Plan(lever(preload), runs=1, duration=0.6, sigma=(0.4, 0.4, 0.4)))
    known, ours = batch.knowledge, JointEkf(batch)
    ekf = ExtendedKalmanFilter(5, 2)
    ekf.x = np.concatenate((np.zeros(3), batch.y[0, 0]))
    ekf.R = np.diag(known.output_noise**2)
    ekf.P = np.diag([*known.sigma**2, *known.output_noise**2])
    ekf.Q[:] = np.diag([*known.walk**2 * PERIOD, 0.0, 0.0])
    ekf.Q[3:, 3:] = known.process_covariance(PERIOD)
    ekf.B = np.eye(5)

    def move(z: Array, k: int) -> Array:
        return np.concatenate((z[:3], batch.move(k, z[np.newaxis, 3:], z[np.newaxis, :3])[0]))

    for k in range(1, batch.samples):
        ours.step(k)
        ekf.F = np.stack([move(ekf.x + 1e-30j * axis, k - 1).imag / 1e-30 for axis in np.eye(5)], axis=1)
        ekf.predict(u=move(ekf.x, k - 1) - ekf.F @ ekf.x)
        ekf.update(batch.y[0, k], lambda z: np.eye(5)[3:], lambda z: z[3:])
        np.testing.assert_allclose(np.concatenate((ours.w[0], ours.x[0])), ekf.x, atol=1e-7)
    np.testing.assert_allclose(ours.covariance[0], ekf.P, rtol=1e-5, atol=1e-10)
    assert np.abs(ours.w).max() > 0.05


def test_algorithm1_ahead_is_the_kalman_filter_of_every_nth_sample() -> None:
    """Of a linear system, whose states and slopes over n samples are products of those over one."""
    batch, n = driven(runs=1), 7
    known, ours, one = batch.knowledge, ParameterFilter(batch, n), plain_filter(batch, 0, 2)
    kf = KalmanFilter(3, 2)
    kf.x, kf.Q = np.zeros(3), np.diag((known.walk / known.sigma) ** 2) * PERIOD * n
    motion = np.linalg.matrix_power(one.F, n)
    kf.R = one.R + motion @ one.R @ motion.T + known.process_covariance(n * PERIOD)
    for k in range(n, batch.samples, n):
        expected, kf.H = batch.y[0, k - n], np.zeros((2, 3))
        for j in range(k - n, k):
            phi = inputs(batch, 0, j)
            expected = one.F @ expected + one.B @ (phi[np.newaxis] @ known.guess)
            kf.H = one.F @ kf.H + one.B @ (phi * known.sigma)[np.newaxis]
            ours.step(j + 1)
        kf.predict()
        kf.update(batch.y[0, k] - expected)
        np.testing.assert_allclose(ours.w[0], kf.x, atol=1e-10)
        np.testing.assert_allclose(ours.innovation_covariance[0], kf.S, rtol=1e-10)
    np.testing.assert_allclose(ours.w_covariance[0], kf.P, atol=1e-12)
    assert np.abs(ours.w).max() > 0.1


def test_algorithm1_sees_how_the_model_bends() -> None:
    """The rate grows by dt p², of variance dt² (4 p² σ² + 2 σ⁴); its noise is that of two samples and of between."""
    batch = driven(model=Curved(), runs=1, duration=0.1, walk=(0.0, 0.0, 0.0))
    known, ours = batch.knowledge, ParameterFilter(batch, 1)
    ours.step(1)
    p, variance = known.guess[0], known.sigma[0] ** 2
    noise = 2.0 * known.output_noise[1] ** 2 + known.process_covariance(PERIOD)[1, 1]
    bent = PERIOD**2 * (4.0 * p**2 * variance + 2.0 * variance**2)
    assert ours.innovation_covariance[0, 1, 1] - noise == pytest.approx(bent, rel=1e-6)
    assert ours.innovation[0, 1] == pytest.approx(batch.y[0, 1, 1] - batch.y[0, 0, 1] - PERIOD * (p**2 + variance))


def test_a_covariance_without_a_factor_is_one_runs_affair() -> None:
    good, bad = np.diag([4.0, 9.0, 1.0]), np.diag([1.0, -1e-9, 1.0])
    factors = factor(np.stack((good, bad)))
    np.testing.assert_array_equal(factors[0], np.diag([2.0, 3.0, 1.0]))
    assert np.isnan(factors[1]).all()


# --- unscented -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("alpha", "rounding"), [(1.0, 1e-7), (1e-3, 1e-6)])
def test_joint_ukf_is_the_unscented_filter_of_filterpy(alpha: float, rounding: float) -> None:
    """With sigma points drawn anew for the outputs, which FilterPy leaves to its user.

    The weights of the unscented transform are about 1/alpha², with opposite signs: a step rounds to 2e-16 of that, and
    400 steps of 2e-10 in the same direction come to 1e-7; hence the bound for the small alpha, with a margin of ten.
    """
    batch = simulate(Plan(lever("trim"), runs=1, duration=0.4, sigma=(0.4, 0.4, 0.4)))
    known, ours = batch.knowledge, JointUkf(batch, UnscentedTransform(alpha))

    def move(z: Array, dt: float, k: int) -> Array:
        return np.concatenate((z[:3], batch.move(k, z[np.newaxis, 3:], z[np.newaxis, :3])[0]))

    points = MerweScaledSigmaPoints(5, alpha, 2.0, 0.0)
    ukf = UnscentedKalmanFilter(5, 2, PERIOD, lambda z: z[3:], move, points)
    ukf.x, ukf.R = np.concatenate((np.zeros(3), batch.y[0, 0])), np.diag(known.output_noise**2)
    ukf.P = np.diag([*known.sigma**2, *known.output_noise**2])
    ukf.Q = np.diag([*known.walk**2 * PERIOD, 0.0, 0.0])
    ukf.Q[3:, 3:] = known.process_covariance(PERIOD)
    for k in range(1, batch.samples):
        ours.step(k)
        ukf.predict(k=k - 1)
        ukf.sigmas_f = points.sigma_points(ukf.x, ukf.P)
        ukf.update(batch.y[0, k])
        np.testing.assert_allclose(np.concatenate((ours.w[0], ours.x[0])), ukf.x, atol=rounding)
    np.testing.assert_allclose(ours.covariance[0], ukf.P, rtol=1e-4, atol=1e-9)
    assert np.abs(ours.w).max() > 0.05


@pytest.mark.parametrize("joint", [JointEkf, JointUkf])
def test_of_a_linear_system_it_is_the_kalman_filter_which_skips_a_missing_output(joint: type[JointEkf]) -> None:
    """Without theta_dot from a sample on: FilterPy's filter with theta as its only output."""
    batch, last = driven(runs=1, duration=0.3), 99
    missing = np.zeros(batch.y.shape, dtype=bool)
    missing[:, last + 1 :, 1] = True
    y = np.where(missing, 1e3, batch.y)
    ours, kf = joint(replace(batch, y=y, missing=missing)), plain_filter(batch, 0, 5)
    for k in range(1, batch.samples):
        ours.step(k)
        phi = inputs(batch, 0, k - 1)
        kf.F[4, :3] = PERIOD * batch.knowledge.sigma * phi
        kf.predict(u=phi[np.newaxis] @ batch.knowledge.guess)
        if k <= last:
            kf.update(batch.y[0, k])
            np.testing.assert_allclose(ours.innovation_covariance[0], kf.S, rtol=1e-6)
        else:
            kf.update(batch.y[0, k, :1], R=kf.R[:1, :1], H=kf.H[:1])
            assert ours.innovation[0, 1] == 0.0
        if k == last:
            nis = follow(joint(batch), np.array([last])).nis
            assert nis is not None
            assert nis[0, 0] == pytest.approx(kf.mahalanobis**2, rel=1e-4)
    np.testing.assert_allclose(np.concatenate((ours.w[0], ours.x[0])), kf.x, atol=1e-7)
    np.testing.assert_allclose(ours.covariance[0], kf.P, atol=1e-8)
