"""Normalised least mean squares, on the model as a linear regression (regression.py).

Source: S. J. Elliott, "Signal processing for active control", Academic Press (2001), ch. 2:

    q = q + μ S² φ (t - φᵀ q) / (r + φᵀ S² φ)

S, diagonal, makes the regressors comparable: as its users would, they are scaled with what is known of q, its standard
deviation, and r, which keeps the quotient finite, is the variance of a target's noise. LMS tells no uncertainty. The
default of μ is the best of 0.003 to 0.3 on the runs of rls.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..data import PARAMETERS, Batch, Estimates
from .regression import equations


@dataclass(frozen=True)
class Nlms:
    """Learns once in `window` [s] from what is faster than `corner` [Hz], with the gain `step` (μ, 0 to 2)."""

    window: float = 0.02
    step: float = 0.1
    corner: float = 1.0

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run the normalised LMS over a batch; report at the samples `at`, without a covariance."""
        data = equations(batch, self.window, self.corner)
        guess, covariance = data.first_guess(batch.knowledge)
        scale = covariance.diagonal()
        q = np.empty((batch.runs, len(data.ends) + 1, PARAMETERS))
        q[:, 0] = guess
        with np.errstate(over="ignore", invalid="ignore"):
            for j in range(len(data.ends)):
                phi = data.regressors[:, j]
                error = data.target[:, j] - (phi * q[:, j]).sum(axis=1)
                norm = data.variance + (scale * phi**2).sum(axis=1)
                q[:, j + 1] = q[:, j] + self.step * scale * phi * (error / norm)[:, np.newaxis]
        return data.estimates(at, batch.knowledge, q, None)
