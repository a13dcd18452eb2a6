"""Dual extended Kalman filter: a state filter at the latest parameters, a parameter filter on its innovations.

Source: E. A. Wan, A. T. Nelson, "Dual extended Kalman filter methods", ch. 5 of S. Haykin (ed.), "Kalman filtering and
neural networks", Wiley (2001); the recurrent derivatives: A. T. Nelson, "Nonlinear estimation and modeling of noisy
time series by dual Kalman filtering methods", PhD thesis, OGI (2000). With F = ∂f/∂x, G = ∂f/∂w and V = dx/dw:

    walk        P_w⁻ = P_w + Q_w
    state       x⁻ = f(x, w);  P⁻ = F P Fᵀ + Q;  S = P⁻ + R;  K = P⁻ S⁻¹;  x = x⁻ + K ν;  P = P⁻ - K S Kᵀ
    derivative  V⁻ = F V + G;  V = (I - K) V⁻
    parameters  S_w = V⁻ P_w⁻ V⁻ᵀ + S;  K_w = P_w⁻ V⁻ᵀ S_w⁻¹;  w = w + K_w ν;  P_w = P_w⁻ - K_w S_w K_wᵀ

V follows the whole past of the state estimate, the gain's part I - K H included; that K itself moves with w is left
out, as is usual. As its users would: the noise of the parameter filter's output is the innovation's covariance S, which
makes a likelihood of the source's prediction-error cost; x stays where it is when w moves, as published.
"""

from __future__ import annotations

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import PARAMETERS, STATES, Batch, Estimates
from .in_c import followed
from .recursion import (
    Slopes,
    apply,
    gain,
    no_innovation,
    output_covariance,
    repeated,
    transposed,
    walk_covariance,
)


def dual_ekf(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Run over the whole batch."""
    return followed("DUAL_EKF", batch, at, DualEkf)


class DualEkf:
    """B filters in step (recursion.Recursion)."""

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
