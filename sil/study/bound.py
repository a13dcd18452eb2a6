"""How good an estimator can be at best: the posterior Cramér–Rao bound of a batch, run by run.

P. Tichavský, C. Muravchik, A. Nehorai, "Posterior Cramér–Rao bounds for discrete-time nonlinear filtering", IEEE Trans.
Signal Processing 46 (1998). For z = [w; x] of a run with additive Gaussian noise its recursion of information matrices
is, by the matrix inversion lemma, that of the covariance of a Kalman filter linearised at the true trajectory:

    P⁻ = F P Fᵀ + Q,   F = df/dz at the truth
    K = P⁻ Hᵀ (H P⁻ Hᵀ + R)⁻¹,   P = (I - K H) P⁻ (I - K H)ᵀ + K R Kᵀ

*Why covariances.* The paper's own form needs Q⁻¹. Our Q is singular wherever a parameter has no walk, or the model no
process noise, and next to singular always: the noise of theta is that of theta_dot integrated over one sample. The
form above asks for nothing but R > 0.

*What averaging means.* The paper takes the expectation over trajectories inside the recursion, of the matrices made of
F and Q⁻¹, so that one bound holds for the mean over all runs. Here each run has a bound of its own, given its inputs
and its truth, and mean squares of errors are held against the mean of these bounds over runs. A Schur complement is
concave in the matrix it is taken of, and an inverse convex: so that mean is never less than the paper's bound. It is
the stricter measure, and nearer to what can be reached, since an estimator sees the inputs and nearly sees the truth.
Where F does not depend on the truth both are the same, and the Kalman filter reaches them. Elsewhere it is strictly no
limit: while the prior still counts an estimator may get below it.

*Where it starts.* As an estimator does: at the first sample, knowing theta and theta_dot as well as they are measured
and w as well as it is guessed. That the lever rests there is not used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..oracle.cdkf import Array
from .data import PARAMETERS, STATES, Batch, Knowledge

_DIFFERENCE = 1e-4  # of w, theta [rad] and theta_dot [rad/s], for derivatives: right to 1e-8 of their size
_BLOCK = 500  # samples linearised at a time, so that the arrays stay in the cache
_SIZE = PARAMETERS + STATES


@dataclass(frozen=True)
class Bound:
    """The bounds of a batch's runs."""

    at: NDArray[np.int64]
    """(T,) indices of samples, rising; what is known there includes the sample itself."""
    covariance: Array
    """(B, T, 5, 5) of [w; theta, theta_dot]."""


def posterior_bound(batch: Batch, at: NDArray[np.int64]) -> Bound:
    """The bound at the samples `at` of every run. Raises ValueError where the truth is no member of the model."""
    z = _truth(batch)
    process = _process_covariance(batch.knowledge, batch.period)
    noise = np.diag(batch.knowledge.output_noise**2)
    p = np.tile(np.diag((*batch.knowledge.sigma_w**2, *batch.knowledge.output_noise**2)), (batch.runs, 1, 1))
    last = int(at[-1])
    kept, wanted = {0: p}, set(at.tolist())
    for begin in range(0, last, _BLOCK):
        for k, transition in enumerate(_transitions(batch, z, begin, min(begin + _BLOCK, last)), begin + 1):
            p = _update(transition @ p @ transition.transpose(0, 2, 1) + process, noise)
            if k in wanted:
                kept[k] = p
    return Bound(at, np.stack([kept[k] for k in at.tolist()], axis=1))


def variances(batch: Batch, bound: Bound) -> Array:
    """(B, T, 5) least variances of w and of natural frequency and damping ratio, relative to the truth.

    The latter two by the delta method. These are what the squares of `scores.errors` are to be held against.
    """
    w = batch.knowledge.scaled(_parameters(batch)[:, bound.at])
    covariance = bound.covariance[..., :PARAMETERS, :PARAMETERS]
    own = np.diagonal(covariance, axis1=-2, axis2=-1)
    return np.concatenate((own, dynamics_variances(batch, bound.at, w, covariance)), axis=-1)


def rms(batch: Batch, bound: Bound) -> Array:
    """(T, 5) least rms errors over the runs, of the quantities of `variances`."""
    root: Array = np.sqrt(variances(batch, bound).mean(axis=0))
    return root


def dynamics_variances(batch: Batch, at: NDArray[np.int64], w: Array, covariance: Array) -> Array:
    """(B, T, 2) of the logarithms of natural frequency and damping ratio, for w (B, T, 3) as uncertain as `covariance`.

    First order, by differences of the logarithm; `covariance` is (B, T, 3, 3).
    """
    angle = batch.rest(at)

    def logarithms(index: int, sign: float) -> Array:
        moved = w + sign * _DIFFERENCE * np.eye(PARAMETERS)[index]
        dynamics = batch.model.dynamics(np.moveaxis(batch.knowledge.physical(moved), -1, 0), angle)
        return np.moveaxis(np.log(dynamics), 0, -1)

    columns = [(logarithms(i, 1.0) - logarithms(i, -1.0)) / (2.0 * _DIFFERENCE) for i in range(PARAMETERS)]
    gradient = np.stack(columns, axis=-1)
    spread: Array = np.einsum("btqi,btij,btqj->btq", gradient, covariance, gradient)
    return spread


def _parameters(batch: Batch) -> Array:
    if batch.truth.p is None:
        raise ValueError("no bound: the truth is no member of the model")
    return batch.truth.p


def _truth(batch: Batch) -> Array:
    """(5, B, K) z along the true trajectories."""
    w = batch.knowledge.scaled(_parameters(batch))
    return np.ascontiguousarray(np.moveaxis(np.concatenate((w, batch.truth.x), axis=-1), -1, 0))


def _process_covariance(knowledge: Knowledge, period: float) -> Array:
    covariance = np.zeros((_SIZE, _SIZE))
    covariance[:PARAMETERS, :PARAMETERS] = np.diag(knowledge.walk_w**2 * period)
    covariance[PARAMETERS:, PARAMETERS:] = knowledge.process_covariance(period)
    return covariance


def _transitions(batch: Batch, z: Array, begin: int, end: int) -> Array:
    """(n, B, 5, 5) F of the steps from the samples begin to end - 1, by central differences."""
    mean = 0.5 * (batch.u[:, begin:end] + batch.u[:, begin + 1 : end + 1])
    u, trim, start = (mean[..., 0], mean[..., 1]), batch.trim[:, begin:end], z[:, :, begin:end]

    def moved(index: int, difference: float) -> Array:
        shifted = start.copy()
        shifted[index] += difference
        p = np.moveaxis(batch.knowledge.physical(np.moveaxis(shifted[:PARAMETERS], 0, -1)), -1, 0)
        return batch.model.step(shifted[PARAMETERS:], p, u, trim, batch.period)

    transitions = np.zeros((end - begin, batch.runs, _SIZE, _SIZE))
    transitions[..., :PARAMETERS, :PARAMETERS] = np.eye(PARAMETERS)
    for index in range(_SIZE):
        slope = (moved(index, _DIFFERENCE) - moved(index, -_DIFFERENCE)) / (2.0 * _DIFFERENCE)
        transitions[..., PARAMETERS:, index] = slope.transpose(2, 1, 0)
    return transitions


def _update(p: Array, noise: Array) -> Array:
    """(B, 5, 5) covariance after a sample of both states with the covariance `noise` (2, 2), of that before it."""
    gain = p[:, :, PARAMETERS:] @ np.linalg.inv(p[:, PARAMETERS:, PARAMETERS:] + noise)
    remains = np.tile(np.eye(_SIZE), (len(p), 1, 1))
    remains[:, :, PARAMETERS:] -= gain
    updated: Array = remains @ p @ remains.transpose(0, 2, 1) + gain @ noise @ gain.transpose(0, 2, 1)
    return updated
