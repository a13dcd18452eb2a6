"""The filter linearised at the truth and the bound, against Kalman filters, Fisher and Monte Carlo."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from lever_cdkf.firmware.config import settings_table
from lever_cdkf.models.lever import Lever
from lever_sil.study import bound, linearised
from lever_sil.study.data import Batch, Knowledge, Truth
from lever_sil.study.matched import Condition, matched
from numpy.typing import NDArray
from scipy.linalg import block_diag

Array = NDArray[Any]  # of floats
DT, STEPS, RUNS = 1e-2, 700, 30
OUTPUT = np.eye(2, 5, 3)


@dataclasses.dataclass(frozen=True)
class Pushed:
    """An oscillator with a drift of its angle, a constant push and a gain of its input to be estimated: linear in x and
    in p, so that the Kalman filter on [w; x] is the best there is."""

    preload: str = "trim"

    def matrix(self, u: float | Array) -> Array:
        """Return (5, 5, …) of [p; x] over a step, written out."""
        u = np.asarray(u)
        f = np.zeros((5, 5, *u.shape))
        f[range(5), range(5)] = 1.0
        f[3, 0], f[3, 4] = DT, DT
        f[4, 1], f[4, 2], f[4, 3], f[4, 4] = DT, DT * u, -4.0 * DT, 1.0 - 0.5 * DT
        return f

    def step(self, x: Array, p: Array, u: tuple[float | Array, float | Array], trim: float | Array, dt: float) -> Array:
        assert dt == DT
        z = np.stack(np.broadcast_arrays(*p, *x))
        moved: Array = np.einsum("ij...,j...->i...", self.matrix(np.broadcast_to(u[0], z.shape[1:])), z)[3:]
        return moved

    def dynamics(self, p: Array, trim: float | Array) -> Array:
        return np.array((np.exp(0.1 * p[1]), np.exp(p[0] - 2.0 * p[2])))


def process_covariance(known: Knowledge) -> Array:
    own: Array = known.process_noise**2 * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]])
    covariance: Array = block_diag(np.diag((known.walk / known.sigma) ** 2 * DT), own)
    return covariance


def scaled_matrix(known: Knowledge, u: float) -> Array:
    """Return the scaled matrix of [w; x]: p = sigma w."""
    scale = np.diag((*known.sigma, 1.0, 1.0))
    f: Array = np.linalg.inv(scale) @ Pushed().matrix(u) @ scale
    return f


@functools.cache
def linear_batch() -> Batch:
    """Return the linear batch of truths drawn with matrices, here."""
    rng = np.random.default_rng(17)
    sigma, walk, noise = np.array([0.1, 0.5, 0.8]), np.array([0.01, 0.02, 0.05]), np.array([0.02, 0.1])
    known = Knowledge(np.zeros(3), sigma, walk, False, noise, process_noise=0.05)
    u = np.stack((2.0 * rng.standard_normal((RUNS, STEPS)), np.zeros((RUNS, STEPS))), axis=-1)
    root = np.linalg.cholesky(process_covariance(known))
    z = np.empty((RUNS, STEPS, 5))
    z[:, 0] = rng.standard_normal((RUNS, 5)) * [1.0, 1.0, 1.0, 0.0, 0.0]
    for k in range(STEPS - 1):
        f = np.stack([scaled_matrix(known, mean) for mean in u[:, k : k + 2, 0].mean(axis=1)])
        z[:, k + 1] = np.einsum("bij,bj->bi", f, z[:, k]) + rng.standard_normal((RUNS, 5)) @ root.T
    y = z[..., 3:] + known.output_noise * rng.standard_normal((RUNS, STEPS, 2))
    p, trim = z[..., :3] * known.sigma, np.zeros((RUNS, STEPS))
    dynamics = np.moveaxis(Pushed().dynamics(np.moveaxis(p, -1, 0), 0.0), 0, -1)
    return Batch(Pushed(), DT, y, u, trim, known, Truth(z[..., 3:], p, dynamics), y, u)


def kalman(run: int) -> Array:
    """Return covariances (K, 5, 5) of FilterPy's Kalman filter on [w; x], started at the first sample."""
    batch, known = linear_batch(), linear_batch().knowledge
    reference = KalmanFilter(dim_x=5, dim_z=2)
    reference.x = np.concatenate((np.zeros(3), batch.y[run, 0]))[:, None]
    reference.P = np.diag((1.0, 1.0, 1.0, *known.output_noise**2))
    reference.Q, reference.R, reference.H = process_covariance(known), np.diag(known.output_noise**2), OUTPUT
    covariances = [reference.P.copy()]
    for k in range(1, STEPS):
        reference.predict(F=scaled_matrix(known, float(batch.u[run, k - 1 : k + 1, 0].mean())))
        reference.update(batch.y[run, k])
        covariances.append(reference.P.copy())
    return np.array(covariances)


# --- the filter linearised at the truth ------------------------------------------------------------------------------


def test_of_a_linear_system_it_is_the_covariance_of_the_kalman_filter() -> None:
    at = np.array([0, 1, 2, 10, 499, 500, 501, 699])
    found = linearised.covariances(linear_batch(), at)
    assert found.shape == (RUNS, len(at), 5, 5)
    for run in (0, 7):
        np.testing.assert_allclose(found[run], kalman(run)[at], rtol=1e-6, atol=1e-12)


def test_without_any_process_noise_it_is_the_inverse_of_fishers_information() -> None:
    """A constant truth, Q = 0: prior information and Σ (dy/dz_0)ᵀ R⁻¹ (dy/dz_0) of all samples, at the last."""
    still = {f"{name}_walk": 0.0 for name in ("m_p", "c_p", "k_p")} | {"theta_dot_process_noise": 0.0}
    batch = matched(Condition(dither_rms=0.3, settings=still), 1, 1.5, 4)
    assert batch.truth.p is not None
    known, last = batch.knowledge, batch.samples - 1
    start = np.concatenate((known.scaled(batch.truth.p[0, 0]), batch.truth.x[0, 0]))
    difference = 1e-4

    def outputs(z: Array) -> Array:
        x, states = z[3:], [z[3:]]
        p = known.guess * np.exp(z[:3])
        for k in range(last):
            u = 0.5 * (batch.u[0, k] + batch.u[0, k + 1])
            x = batch.model.step(x, p, (u[0], u[1]), batch.trim[0, k], batch.period)
            states.append(x)
        return np.array(states)

    axes = difference * np.eye(5)
    slopes = np.stack([(outputs(start + axis) - outputs(start - axis)) / (2 * difference) for axis in axes], axis=-1)
    weight = np.diag(known.output_noise**-2)
    information = np.einsum("kai,ab,kbj->ij", slopes, weight, slopes) + np.diag((*known.sigma_w**-2, 0.0, 0.0))
    carry = np.vstack((np.eye(3, 5), slopes[-1]))
    expected = carry @ np.linalg.inv(information) @ carry.T
    found = linearised.covariances(batch, np.array([last]))[0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6 * expected[0, 0] * known.output_noise[0])


def test_a_truth_outside_the_model_has_no_reference() -> None:
    batch = linear_batch()
    without = dataclasses.replace(batch, truth=dataclasses.replace(batch.truth, p=None))
    for function in (linearised.covariances, bound.posterior_cramer_rao):
        with pytest.raises(ValueError, match="no member of the model"):
            function(without, np.array([1]))


# --- the bound -------------------------------------------------------------------------------------------------------


def test_the_bound_is_tichavskys_recursion_of_information() -> None:
    """Equations 20 to 24 of the paper as they stand, with the inverse of all of Q; expectations over the runs."""
    batch, last = linear_batch(), 120
    known, weight = batch.knowledge, np.linalg.inv(process_covariance(batch.knowledge))
    information = np.diag((*known.sigma_w**-2, *known.output_noise**-2))
    for k in range(last):
        f = np.stack([scaled_matrix(known, mean) for mean in batch.u[:, k : k + 2, 0].mean(axis=1)])
        mean = f.mean(axis=0)
        scatter = np.einsum("bai,ac,bcj->ij", f - mean, weight, f - mean) / (RUNS - 1)
        d11, d12 = mean.T @ weight @ mean + scatter, -mean.T @ weight
        d22 = weight + OUTPUT.T @ np.diag(known.output_noise**-2) @ OUTPUT
        information = d22 - d12.T @ np.linalg.inv(information + d11) @ d12
    found = bound.posterior_cramer_rao(batch, np.array([10, last]))[1]
    np.testing.assert_allclose(found, np.linalg.inv(information), rtol=1e-4, atol=1e-9)


def test_without_process_noise_there_is_no_bound() -> None:
    batch = linear_batch()
    calm = dataclasses.replace(batch, knowledge=dataclasses.replace(batch.knowledge, process_noise=0.0))
    with pytest.raises(ValueError, match="needs process noise"):
        bound.posterior_cramer_rao(calm, np.array([1]))


def test_dynamics_are_as_uncertain_as_a_cloud_of_parameters() -> None:
    settings = {row.name: row.default for row in settings_table()}
    batch = matched(Condition(preload="fixed", dither_rms=0.3), 2, 3.0, 6)
    at = np.array([1500, 2999])
    found = linearised.covariances(batch, at)
    least = linearised.variances(batch, at, found)
    assert least.shape == (2, 2, 5)
    assert batch.truth.p is not None
    lever, rng = Lever.from_settings(settings, "fixed"), np.random.default_rng(8)
    for run in range(2):
        for t, k in enumerate(at):
            covariance = 1e-4 * found[run, t, :3, :3]  # so near that the first order is all
            w = rng.multivariate_normal(np.log(batch.truth.p[run, k] / batch.knowledge.guess), covariance, 100_000)
            angle = float(batch.rest(at)[run, t])
            cloud = lever.dynamics((batch.knowledge.guess * np.exp(w)).T, angle)
            relative = cloud.std(axis=1) / batch.truth.dynamics[run, k]
            np.testing.assert_allclose(np.sqrt(1e-4 * least[run, t, 3:]), relative, rtol=0.01)
            np.testing.assert_allclose(least[run, t, :3], found[run, t, [0, 1, 2], [0, 1, 2]])
