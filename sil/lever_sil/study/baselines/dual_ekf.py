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
from numpy.typing import NDArray

from ..data import Batch, Estimates
from .in_c import run_in_c


def dual_ekf(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Run over the whole batch."""
    return run_in_c("DUAL_EKF", batch, at)
