"""A balance of accelerations (balance.py) as equations for least squares and LMS, one for each window of samples.

The acceleration is had from θ̇ by the integral-equation approach (H. Unbehauen, G. P. Rao, "A review of identification
in continuous-time systems", Annual Reviews in Control 22 (1998)): both sides are averaged over n samples, and over n
once more, which makes of θ̈ the difference of two neighbouring means of θ̇, divided by n dt. Both sides pass the same
filter, so the equation stays exact (but for the trapezoidal rule). As the weights are even in time on the right side
and odd on the left one, white noise of θ̇ is not correlated between them.

With preload fixed the arm carries the lever's weight, and a drift of k_p by a few per cent is a torque larger than all
that shakes it; what fits the past as well as the present takes that for something else. So both sides are high-pass
filtered, too: what is slow is trim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import Batch, Estimates, Knowledge
from .balance import Coefficients, balance


@dataclass(frozen=True)
class Equations:
    """Of each run J equations target = regressors · q + noise, the j-th complete at sample `ends[j]`."""

    target: Array
    """(B, J) [rad/s²]"""
    regressors: Array
    """(B, J, 3)"""
    ends: NDArray[np.int64]
    """(J,)"""
    period: float
    """from one equation to the next [s]."""
    variance: float
    """of the noise of a target [(rad/s²)²], from the noise of theta_dot and the torque that is not modelled."""
    coefficients: Coefficients

    def first_guess(self, knowledge: Knowledge) -> tuple[Array, Array]:
        """Return q (3,) before the first equation, and what is known of it as a covariance (3, 3), to first order."""
        q = self.coefficients.of_parameters(knowledge.guess)
        to_q = np.linalg.inv(self._slope(q, knowledge))
        return q, to_q @ np.diag(knowledge.sigma_w**2) @ to_q.T

    def estimates(self, at: NDArray[np.int64], knowledge: Knowledge, q: Array, covariance: Array | None) -> Estimates:
        """Return what q (B, J + 1, 3) and its covariance (B, J + 1, 3, 3) say at `at`.

        Both are from before the first equation on.

        Where q means no parameters (a negative mass) the last one that did stands; where it is not finite, NaN.
        """
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            w = knowledge.scaled(self.coefficients.parameters(q))
        broken = ~np.isfinite(q).all(axis=2)
        w[broken] = np.nan
        stands = np.isfinite(w).all(axis=2) | broken
        latest = np.maximum.accumulate(np.where(stands, np.arange(q.shape[1]), 0), axis=1)
        row, column = np.arange(len(q))[:, np.newaxis], latest[:, np.searchsorted(self.ends, at, side="right")]
        if covariance is None:
            return Estimates(at, w[row, column], None)
        slope = self._slope(q[row, column], knowledge)
        return Estimates(at, w[row, column], slope @ covariance[row, column] @ slope.swapaxes(-1, -2))

    def _slope(self, q: Array, knowledge: Knowledge) -> Array:
        """dw/dq, (…, 3, 3)."""
        scale = self.coefficients.parameters(q) if knowledge.positive else np.broadcast_to(knowledge.sigma, q.shape)
        slope: Array = self.coefficients.slope(q) / scale[..., np.newaxis]
        return slope


def equations(batch: Batch, window: float, corner: float) -> Equations:
    """Return one for each `window` [s], without what is slower than `corner` [Hz]; 0: nothing is slow.

    Raise LeverError for a model that is not linear in any coefficients.
    """
    n = max(1, round(window / batch.period))
    of_samples = balance(batch)
    first = np.arange(0, batch.samples - 2 * n + 1, n)
    right = np.concatenate((of_samples.offset[:, :, np.newaxis], of_samples.regressors), axis=2)
    right = _means(_means(0.5 * (right[:, 1:] + right[:, :-1]), n), n)[:, first]
    rate = _means(batch.y[:, :, 1:], n)
    acceleration = (rate[:, first + n] - rate[:, first]) / (n * batch.period)
    columns = np.concatenate((acceleration - right[:, :, :1], right[:, :, 1:]), axis=2)
    period = n * batch.period
    fast = _high_pass(columns, corner, period)
    ends, variance = first + 2 * n - 1, _variance(batch, n)
    return Equations(fast[:, :, 0], fast[:, :, 1:], ends, period, variance, of_samples.coefficients)


def _means(values: Array, n: int) -> Array:
    """Return means (B, K - n + 1, m) of n samples each, the i-th over samples i to i + n - 1."""
    total = np.concatenate((np.zeros_like(values[:, :1]), np.cumsum(values, axis=1)), axis=1)
    means: Array = (total[:, n:] - total[:, :-n]) / n
    return means


def _high_pass(values: Array, corner: float, dt: float) -> Array:
    """First-order high-pass (bilinear) of values (B, J, m), `dt` [s] apart; what they start with is taken as slow."""
    if corner == 0.0:
        return values
    half = np.pi * corner * dt
    passed = np.zeros_like(values)
    for j in range(1, values.shape[1]):
        passed[:, j] = ((1.0 - half) * passed[:, j - 1] + values[:, j] - values[:, j - 1]) / (1.0 + half)
    return passed


def _variance(batch: Batch, n: int) -> float:
    """Return the variance of the difference of neighbouring means of n samples of theta_dot, by n dt.

    It is that of white noise and a random walk.
    """
    white = 2.0 * float(batch.knowledge.output_noise[1]) ** 2 / n
    walk = batch.knowledge.process_noise**2 * batch.period * (2 * n**2 + 1) / (3 * n)
    return (white + walk) / (n * batch.period) ** 2
