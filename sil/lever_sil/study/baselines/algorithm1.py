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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..data import Batch, Estimates
from .in_c import run_in_c


@dataclass(frozen=True)
class Algorithm1:
    """Predicts `ahead` [s], at least one sample, and learns as often."""

    ahead: float = 0.0

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run the filter over a batch; report at the samples `at`."""
        return run_in_c("PARAMETERS", batch, at, steps=max(1, round(self.ahead / batch.period)))
