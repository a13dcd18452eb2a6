"""Joint extended Kalman filter: one filter for parameters and state, z = [w; x].

Source: R. E. Kopp, R. J. Orford, "Linear regression applied to system identification for adaptive control systems",
AIAA Journal 1 (1963); H. Cox, "On the estimation of state variables and parameters for noisy dynamic systems", IEEE TAC
9 (1964); in the form of A. H. Jazwinski, "Stochastic processes and filtering theory", Academic Press (1970), ch. 8.

As its users would: started with what is known of the parameters and with the first sample as the state; derivatives are
exact to rounding; process and measurement noise as known; covariance P - K S Kᵀ; a missing output is skipped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..data import Batch, Estimates
from .in_c import run_in_c


def joint_ekf(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Run over the whole batch."""
    return run_in_c("JOINT_EKF", batch, at)
