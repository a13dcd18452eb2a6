"""The Kalman-type baselines written out in numpy, for all runs at once: what fast/c/filters.c is compared with.

Unlike it they take any model, so that each can be held against a textbook filter. Equations and sources are in
lever_sil/study/baselines: algorithm1.py, dual_ekf.py, joint_ekf.py, joint_ukf.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.baselines.in_c import DIFFERENCE
from lever_sil.study.data import OUTPUTS, PARAMETERS, STATES, Batch, Estimates
from numpy.typing import NDArray

_SKIPPED = 1e6  # noise of a missing output is so many times what it is: it counts for nothing
_SIZE = PARAMETERS + STATES


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


# --- parameters alone ------------------------------------------------------------------------------------------------

H_SQUARED = 3.0
"""Squared step of the central differences: the kurtosis of a Gaussian (Nørgaard et al. 2000)."""
H = math.sqrt(H_SQUARED)
C1 = 1.0 / (2.0 * H)
"""Weight of first differences."""
C2 = math.sqrt(H_SQUARED - 1.0) / (2.0 * H_SQUARED)
"""Weight of second differences."""


class ParameterFilter:
    """B filters in step (Recursion), which predict `steps` samples ahead."""

    def __init__(self, batch: Batch, steps: int) -> None:
        self._batch, self._steps = batch, steps
        self._walk = steps * walk_covariance(batch)
        self._sample_noise = batch.knowledge.output_noise
        self._output_noise = output_covariance(batch) + batch.knowledge.process_covariance(steps * batch.period)
        self.w: Array = np.zeros((batch.runs, PARAMETERS))
        self.w_covariance = repeated(np.diag(batch.knowledge.sigma_w**2), batch.runs)
        self.innovation, self.innovation_covariance = no_innovation(batch.runs)
        self._draw(0)

    def _draw(self, k: int) -> None:
        """Sigma points of the parameters and of the sample from which the model starts, (B, 11, …)."""
        self._prior = self.w_covariance + self._walk
        self._factor = factor(self._prior)
        spread = np.zeros((self._batch.runs, PARAMETERS + STATES, PARAMETERS + STATES))
        spread[:, :PARAMETERS, :PARAMETERS] = H * transposed(self._factor)
        spread[:, PARAMETERS:, PARAMETERS:] = H * np.diag(self._sample_noise)
        centre = np.concatenate((self.w, self._batch.y[:, k]), axis=1)[:, np.newaxis]
        points = np.concatenate((centre, centre + spread, centre - spread), axis=1)
        self._parameters, self._states = points[:, :, :PARAMETERS], points[:, :, PARAMETERS:]

    def step(self, k: int) -> None:
        """Predict the states to sample `k`, and update the parameters every few samples."""
        self._states = self._batch.move(k - 1, self._states, self._parameters)
        if k % self._steps == 0:
            self._update(k)
            self._draw(k)

    def _update(self, k: int) -> None:
        expected, first, second = differences(self._states)
        self.innovation = self._batch.y[:, k] - expected
        self.innovation_covariance = transposed(first) @ first + transposed(second) @ second + self._output_noise
        k_w = gain(self._factor @ first[:, :PARAMETERS], self.innovation_covariance)
        self.w = self.w + apply(k_w, self.innovation)
        self.w_covariance = self._prior - k_w @ self.innovation_covariance @ transposed(k_w)


def differences(values: Array) -> tuple[Array, Array, Array]:
    """Return mean (B, m), first and second differences (B, n, m) of values (B, 2n + 1, m) at sigma points."""
    n = values.shape[1] // 2
    centre, plus, minus = values[:, :1], values[:, 1 : n + 1], values[:, n + 1 :]
    both = plus + minus
    mean = ((H_SQUARED - n) * centre[:, 0] + 0.5 * both.sum(axis=1)) / H_SQUARED
    return mean, C1 * (plus - minus), C2 * (both - 2.0 * centre)


# --- dual ------------------------------------------------------------------------------------------------------------


class DualEkf:
    """B filters in step (Recursion)."""

    def __init__(self, batch: Batch) -> None:
        self._batch, self._slopes = batch, Slopes(batch)
        self._walk = walk_covariance(batch)
        self._process_noise = batch.knowledge.process_covariance(batch.period)
        self._output_noise = output_covariance(batch)
        self.x, self.x_covariance = batch.y[:, 0].copy(), repeated(self._output_noise, batch.runs)
        self.w: Array = np.zeros((batch.runs, PARAMETERS))
        self.w_covariance = repeated(np.diag(batch.knowledge.sigma_w**2), batch.runs)
        self.derivative: Array = np.zeros((batch.runs, STATES, PARAMETERS))
        """(B, 2, 3) V = dx/dw."""
        self.innovation, self.innovation_covariance = no_innovation(batch.runs)

    def step(self, k: int) -> None:
        """Update states, then parameters, with the outputs of sample `k`."""
        predicted, dx, dw = self._slopes.move(k - 1, self.x, self.w)
        derivative = dx @ self.derivative + dw
        covariance = dx @ self.x_covariance @ transposed(dx) + self._process_noise
        self.innovation = self._batch.y[:, k] - predicted
        own = covariance + self._output_noise
        k_x = gain(covariance, own)
        self.x = predicted + apply(k_x, self.innovation)
        self.x_covariance = covariance - k_x @ own @ transposed(k_x)
        self.derivative = derivative - k_x @ derivative
        self._correct_parameters(derivative, own)

    def _correct_parameters(self, derivative: Array, output_noise: Array) -> None:
        covariance = self.w_covariance + self._walk
        cross = covariance @ transposed(derivative)
        self.innovation_covariance = derivative @ cross + output_noise
        k_w = gain(cross, self.innovation_covariance)
        self.w = self.w + apply(k_w, self.innovation)
        self.w_covariance = covariance - k_w @ self.innovation_covariance @ transposed(k_w)


# --- joint -----------------------------------------------------------------------------------------------------------


class Joint:
    """B filters on z = [w; x] in step (Recursion). Both outputs are the state: the update is linear."""

    def __init__(self, batch: Batch) -> None:
        self.batch = batch
        self.output_noise = output_covariance(batch)
        self.process_noise = block_diagonal(walk_covariance(batch), batch.knowledge.process_covariance(batch.period))
        self.w, self.x = np.zeros((batch.runs, PARAMETERS)), batch.y[:, 0].copy()
        initial = block_diagonal(np.diag(batch.knowledge.sigma_w**2), self.output_noise)
        self.covariance = repeated(initial, batch.runs)
        """(B, 5, 5) of [w; x]."""
        self.innovation, self.innovation_covariance = no_innovation(batch.runs)

    @property
    def w_covariance(self) -> Array:
        """(B, 3, 3) covariance of the parameters."""
        return self.covariance[:, :PARAMETERS, :PARAMETERS]

    def predict(self, k: int) -> tuple[Array, Array]:
        """Return states (B, 2) at sample k + 1, and the covariance of [w; x] there; w stays."""
        raise NotImplementedError

    def step(self, k: int) -> None:
        """Predict to sample `k` and update with its outputs; missing outputs are skipped."""
        predicted, covariance = self.predict(k - 1)
        self.innovation, noise = self.batch.y[:, k] - predicted, self.output_noise
        if self.batch.missing is not None:
            missing = self.batch.missing[:, k]
            self.innovation = np.where(missing, 0.0, self.innovation)
            noise = noise * (1.0 + _SKIPPED**2 * missing[:, :, np.newaxis] * np.eye(OUTPUTS))
        self.innovation_covariance = covariance[:, PARAMETERS:, PARAMETERS:] + noise
        k_joint = gain(covariance[:, :, PARAMETERS:], self.innovation_covariance)
        correction = apply(k_joint, self.innovation)
        self.w, self.x = self.w + correction[:, :PARAMETERS], predicted + correction[:, PARAMETERS:]
        self.covariance = covariance - k_joint @ self.innovation_covariance @ transposed(k_joint)


class JointEkf(Joint):
    """Linearised at the estimate."""

    def __init__(self, batch: Batch) -> None:
        super().__init__(batch)
        self._slopes = Slopes(batch)

    def predict(self, k: int) -> tuple[Array, Array]:
        """Return the states at sample `k` + 1 and the joint covariance, by linearisation."""
        predicted, dx, dw = self._slopes.move(k, self.x, self.w)
        transition = repeated(np.eye(PARAMETERS + STATES), self.batch.runs)
        transition[:, PARAMETERS:, :PARAMETERS], transition[:, PARAMETERS:, PARAMETERS:] = dw, dx
        return predicted, transition @ self.covariance @ transposed(transition) + self.process_noise


@dataclass(frozen=True)
class UnscentedTransform:
    """Points and weights of z (5,): alpha, beta and kappa of the source."""

    alpha: float = 1.0
    beta: float = 2.0
    kappa: float = 0.0

    @property
    def reach(self) -> float:
        """Return n + lambda: the squared distance of a point, in standard deviations."""
        return self.alpha**2 * (_SIZE + self.kappa)

    @property
    def weights(self) -> tuple[Array, Array]:
        """(11,) of the mean and of the covariance."""
        mean = np.full(2 * _SIZE + 1, 0.5 / self.reach)
        mean[0] = 1.0 - _SIZE / self.reach
        covariance = mean.copy()
        covariance[0] += 1.0 - self.alpha**2 + self.beta
        return mean, covariance


class JointUkf(Joint):
    """Sigma points in the columns of the Cholesky factor."""

    def __init__(self, batch: Batch, transform: UnscentedTransform | None = None) -> None:
        super().__init__(batch)
        transform = transform or UnscentedTransform()
        self._root, (self._of_mean, self._of_covariance) = np.sqrt(transform.reach), transform.weights

    def predict(self, k: int) -> tuple[Array, Array]:
        """Return the states at sample `k` + 1 and the joint covariance, by sigma points."""
        spread = self._root * transposed(factor(self.covariance))
        offsets = np.concatenate((np.zeros_like(spread[:, :1]), spread, -spread), axis=1)
        w = self.w[:, np.newaxis] + offsets[..., :PARAMETERS]
        moved = self.batch.move(k, self.x[:, np.newaxis] + offsets[..., PARAMETERS:], w)
        predicted: Array = self._of_mean @ moved
        deviation = np.concatenate((offsets[..., :PARAMETERS], moved - predicted[:, np.newaxis]), axis=2)
        weighted = self._of_covariance[:, np.newaxis] * deviation
        return predicted, transposed(deviation) @ weighted + self.process_noise
