"""A batch's model linearised at its true trajectories, and variances of natural frequency and damping ratio.

Shared by the covariance of the Kalman filter linearised at the truth (linearised.py) and the posterior Cramér–Rao bound
(bound.py). State z = [w; theta, theta_dot].
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .data import PARAMETERS, STATES, Batch

SIZE = PARAMETERS + STATES
_DIFFERENCE = 1e-4  # of w, theta [rad] and theta_dot [rad/s], for derivatives: right to 1e-8 of their size
_BLOCK = 500  # samples linearised at a time, so that the arrays stay in the cache


def true_parameters(batch: Batch) -> Array:
    """Return (B, K, 3) in physical units. Raise ValueError where the truth is no member of the model."""
    if batch.truth.p is None:
        raise ValueError("nothing to linearise: the truth is no member of the model")
    return batch.truth.p


def transitions(batch: Batch, last: int) -> Iterator[Array]:
    """F = df/dz at the truth of the steps to the samples 1, 2 … `last`, in blocks (n, B, 5, 5)."""
    w = batch.knowledge.scaled(true_parameters(batch))
    z = np.ascontiguousarray(np.moveaxis(np.concatenate((w, batch.truth.x), axis=-1), -1, 0))
    for begin in range(0, last, _BLOCK):
        yield _block(batch, z, begin, min(begin + _BLOCK, last))


def _block(batch: Batch, z: Array, begin: int, end: int) -> Array:
    """Return (n, B, 5, 5) F of the steps from the samples begin to end - 1, by central differences."""
    mean = 0.5 * (batch.u[:, begin:end] + batch.u[:, begin + 1 : end + 1])
    u, trim, start = (mean[..., 0], mean[..., 1]), batch.trim[:, begin:end], z[:, :, begin:end]

    def moved(index: int, difference: float) -> Array:
        shifted = start.copy()
        shifted[index] += difference
        p = np.moveaxis(batch.knowledge.physical(np.moveaxis(shifted[:PARAMETERS], 0, -1)), -1, 0)
        return batch.model.step(shifted[PARAMETERS:], p, u, trim, batch.period)

    jacobians = np.zeros((end - begin, batch.runs, SIZE, SIZE))
    jacobians[..., :PARAMETERS, :PARAMETERS] = np.eye(PARAMETERS)
    for index in range(SIZE):
        slope = (moved(index, _DIFFERENCE) - moved(index, -_DIFFERENCE)) / (2.0 * _DIFFERENCE)
        jacobians[..., PARAMETERS:, index] = slope.transpose(2, 1, 0)
    return jacobians


def initial_covariance(batch: Batch) -> Array:
    """Return (5, 5) P at the first sample: w as uncertain as it is guessed, the state as it is measured."""
    return np.diag((*batch.knowledge.sigma_w**2, *batch.knowledge.output_noise**2))


def process_covariance(batch: Batch) -> Array:
    """Return (5, 5) Q of one step."""
    covariance = np.zeros((SIZE, SIZE))
    covariance[:PARAMETERS, :PARAMETERS] = np.diag(batch.knowledge.walk_w**2 * batch.period)
    covariance[PARAMETERS:, PARAMETERS:] = batch.knowledge.process_covariance(batch.period)
    return covariance


def measured(p: Array, noise: Array) -> Array:
    """Return covariances (B, 5, 5) after a sample of both states, of those before it.

    The sample has the covariance `noise` (2, 2).
    """
    gain = p[:, :, PARAMETERS:] @ np.linalg.inv(p[:, PARAMETERS:, PARAMETERS:] + noise)
    remains = np.tile(np.eye(SIZE), (len(p), 1, 1))
    remains[:, :, PARAMETERS:] -= gain
    updated: Array = remains @ p @ remains.transpose(0, 2, 1) + gain @ noise @ gain.transpose(0, 2, 1)
    return updated


def dynamics_gradient(batch: Batch, at: NDArray[np.int64], w: Array) -> Array:
    """Return (B, T, 2, 3) of the logarithms of natural frequency and damping ratio by w (B, T, 3).

    They are those at the samples `at`.
    """
    angle = batch.rest(at)

    def logarithms(index: int, sign: float) -> Array:
        moved = w + sign * _DIFFERENCE * np.eye(PARAMETERS)[index]
        dynamics = batch.model.dynamics(np.moveaxis(batch.knowledge.physical(moved), -1, 0), angle)
        return np.moveaxis(np.log(dynamics), 0, -1)

    columns = [(logarithms(i, 1.0) - logarithms(i, -1.0)) / (2.0 * _DIFFERENCE) for i in range(PARAMETERS)]
    return np.stack(columns, axis=-1)


def with_dynamics(covariance: Array, gradient: Array) -> Array:
    """Return (…, 5) variances of w and, to first order, of the logarithms of natural frequency and damping ratio.

    `covariance` (…, 3, 3) of w, `gradient` (…, 2, 3) as of dynamics_gradient().
    """
    own = np.diagonal(covariance, axis1=-2, axis2=-1)
    dynamics = np.einsum("...qi,...ij,...qj->...q", gradient, covariance, gradient)
    return np.concatenate((own, dynamics), axis=-1)
