"""A sigma-point filter for the parameters alone ("Algorithm 1"): no state filter, full covariance.

Source: R. van der Merwe, "Sigma-point Kalman filters for probabilistic inference in dynamic state-space models", PhD
thesis, OGI (2004), ch. 3.5: the central difference Kalman filter for parameters, with P = P - K P_yy Kᵀ; E. A. Wan,
R. van der Merwe, "The unscented Kalman filter", ch. 7 of S. Haykin (ed.), "Kalman filtering and neural networks",
Wiley (2001). With N samples from one update to the next:

    walk         P_w⁻ = P_w + N Q_w
    output       y_k = f(…f(x_{k-N}, w)…, w) + noise of the sample + torque that is not modelled, with x_{k-N} = y_{k-N}
    update       K = P_wy P_yy⁻¹;  w = w + K (y_k - ŷ_k);  P_w = P_w⁻ - K P_yy Kᵀ

As its users would: the measured sample is the state from which the model starts. Its noise reaches the output through
the model, so sigma points are drawn of it, too (it is noise, nothing of it is learnt). What no choice of noise can tell
this filter is that the noise of y_k returns, with the other sign, in the next innovation; at 1 kHz that is the greater
part of it, and some 30 ms ahead do better (of 1 to 100 ms on the runs of rls.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import PARAMETERS, STATES, Batch, Estimates
from .in_c import followed
from .recursion import (
    apply,
    factor,
    gain,
    no_innovation,
    output_covariance,
    repeated,
    transposed,
    walk_covariance,
)

H_SQUARED = 3.0
"""Squared step of the central differences: the kurtosis of a Gaussian (Nørgaard et al. 2000)."""
H = math.sqrt(H_SQUARED)
C1 = 1.0 / (2.0 * H)
"""Weight of first differences."""
C2 = math.sqrt(H_SQUARED - 1.0) / (2.0 * H_SQUARED)
"""Weight of second differences."""


@dataclass(frozen=True)
class Algorithm1:
    """Predicts `ahead` [s], at least one sample, and learns as often."""

    ahead: float = 0.0

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run the filter over a batch; report at the samples `at`."""
        steps = max(1, round(self.ahead / batch.period))
        return followed("PARAMETERS", batch, at, lambda same: ParameterFilter(same, steps), steps=steps)


class ParameterFilter:
    """B filters in step (recursion.Recursion), which predict `steps` samples ahead."""

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
