"""What the Kalman-type baselines share: the walk through the samples, the first differences of a step, the gain."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import OUTPUTS, PARAMETERS, STATES, Batch, Estimates

DIFFERENCE = 1e-5
"""Half-width of a central difference in theta [rad], theta_dot [rad/s] or w [1]: near the cube root of float64's
rounding, where the errors of truncation and of rounding are about equal."""


class Recursion(Protocol):
    """A filter of B runs. At first all of it is of sample 0, and after `step(k)` of sample k."""

    w: Array
    """(B, 3)"""
    innovation: Array
    """(B, 2) of the latest update; NaN before the first."""
    innovation_covariance: Array
    """(B, 2, 2)"""

    @property
    def w_covariance(self) -> Array:
        """Return the covariance of w, (B, 3, 3)."""

    def step(self, k: int) -> None:
        """From sample k - 1 to sample k."""


def follow(recursion: Recursion, at: NDArray[np.int64]) -> Estimates:
    """Step from sample 0 to the last of `at`. A run that breaks down goes on as NaN and leaves the others alone."""
    shape = (len(recursion.w), len(at))
    w, covariance = np.empty((*shape, PARAMETERS)), np.empty((*shape, PARAMETERS, PARAMETERS))
    nis = np.empty(shape)
    done = 0
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for column, sample in enumerate(at.tolist()):
            for k in range(done + 1, sample + 1):
                recursion.step(k)
            done = sample
            w[:, column], covariance[:, column] = recursion.w, recursion.w_covariance
            nis[:, column] = normalised_square(recursion.innovation, recursion.innovation_covariance)
    broken = ~np.isfinite(w).all(axis=2)
    w[broken], covariance[broken], nis[broken] = np.nan, np.nan, np.nan
    return Estimates(at, w, covariance, nis)


def transposed(matrices: Array) -> Array:
    """Return each of the matrices (B, n, m) transposed."""
    return matrices.swapaxes(1, 2)


def apply(matrices: Array, vectors: Array) -> Array:
    """Return (B, n, m) times (B, m)."""
    product: Array = (matrices @ vectors[:, :, np.newaxis])[:, :, 0]
    return product


def gain(cross: Array, innovation_covariance: Array) -> Array:
    """K = P_xy P_yy⁻¹, (B, n, m), of the covariance of state and output (B, n, m) and of the innovation (B, m, m)."""
    return transposed(np.linalg.solve(innovation_covariance, transposed(cross)))


def normalised_square(innovation: Array, covariance: Array) -> Array:
    """νᵀ S⁻¹ ν, (B,)."""
    square: Array = (innovation * np.linalg.solve(covariance, innovation[:, :, np.newaxis])[:, :, 0]).sum(axis=1)
    return square


def factor(covariance: Array) -> Array:
    """Cholesky factors (B, n, n); NaN for a run whose covariance is no longer positive definite."""
    try:
        return np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return np.stack([_factor_or_nan(run) for run in covariance])


def _factor_or_nan(covariance: Array) -> Array:
    try:
        return np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return np.full_like(covariance, np.nan)


class Slopes:
    """The step of a batch's model with its first derivatives, by central differences in one call of the model."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        inputs = STATES + PARAMETERS
        offsets = DIFFERENCE * np.concatenate((np.zeros((1, inputs)), np.eye(inputs), -np.eye(inputs)))
        self._x, self._w = offsets[:, :STATES], offsets[:, STATES:]

    def move(self, k: int, x: Array, w: Array) -> tuple[Array, Array, Array]:
        """Return states (B, 2) at sample k + 1 of x (B, 2) at sample k with w (B, 3), and their derivatives.

        These are dx⁺/dx (B, 2, 2), dx⁺/dw (B, 2, 3).
        """
        moved = self._batch.move(k, x[:, np.newaxis] + self._x, w[:, np.newaxis] + self._w)
        half = STATES + PARAMETERS + 1
        slopes = transposed((moved[:, 1:half] - moved[:, half:]) / (2.0 * DIFFERENCE))
        return moved[:, 0], slopes[:, :, :STATES], slopes[:, :, STATES:]


def output_covariance(batch: Batch) -> Array:
    """Return (2, 2) R of a sample."""
    return np.diag(batch.knowledge.output_noise**2)


def walk_covariance(batch: Batch) -> Array:
    """Return (3, 3) of the random walk of w over one sample period."""
    return np.diag(batch.knowledge.walk_w**2) * batch.period


def block_diagonal(first: Array, second: Array) -> Array:
    """Return the matrix with the two blocks and zeros elsewhere."""
    n, m = len(first), len(second)
    return np.block([[first, np.zeros((n, m))], [np.zeros((m, n)), second]])


def repeated(matrix: Array, runs: int) -> Array:
    """Return (B, …): the same for each run."""
    return np.repeat(matrix[np.newaxis], runs, axis=0)


def no_innovation(runs: int) -> tuple[Array, Array]:
    """Return what there is before the first update: NaN, of covariance I."""
    return np.full((runs, OUTPUTS), np.nan), repeated(np.eye(OUTPUTS), runs)
