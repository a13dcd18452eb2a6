"""Joint extended Kalman filter: one filter for parameters and state, z = [w; x].

Source: R. E. Kopp, R. J. Orford, "Linear regression applied to system identification for adaptive control systems",
AIAA Journal 1 (1963); H. Cox, "On the estimation of state variables and parameters for noisy dynamic systems", IEEE TAC
9 (1964); in the form of A. H. Jazwinski, "Stochastic processes and filtering theory", Academic Press (1970), ch. 8.

As its users would: started with what is known of the parameters and with the first sample as the state; derivatives are
exact to rounding; process and measurement noise as known; covariance P - K S Kᵀ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...oracle.cdkf import Array
from ..data import PARAMETERS, STATES, Batch, Estimates
from .recursion import (
    Slopes,
    apply,
    block_diagonal,
    follow,
    gain,
    no_innovation,
    output_covariance,
    repeated,
    transposed,
    walk_covariance,
)


def joint_ekf(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Runs over the whole batch."""
    return follow(JointEkf(batch), at)


class JointEkf:
    """B filters in step (recursion.Recursion)."""

    def __init__(self, batch: Batch) -> None:
        self._batch, self._slopes = batch, Slopes(batch)
        self._output_noise = output_covariance(batch)
        self._process_noise = block_diagonal(walk_covariance(batch), batch.knowledge.process_covariance(batch.period))
        self.w, self.x = np.zeros((batch.runs, PARAMETERS)), batch.y[:, 0].copy()
        known = block_diagonal(np.diag(batch.knowledge.sigma_w**2), self._output_noise)
        self.covariance = repeated(known, batch.runs)
        """(B, 5, 5) of [w; x]."""
        self.innovation, self.innovation_covariance = no_innovation(batch.runs)

    @property
    def w_covariance(self) -> Array:
        return self.covariance[:, :PARAMETERS, :PARAMETERS]

    def step(self, k: int) -> None:
        predicted, dx, dw = self._slopes.move(k - 1, self.x, self.w)
        transition = repeated(np.eye(PARAMETERS + STATES), self._batch.runs)
        transition[:, PARAMETERS:, :PARAMETERS], transition[:, PARAMETERS:, PARAMETERS:] = dw, dx
        covariance = transition @ self.covariance @ transposed(transition) + self._process_noise

        self.innovation = self._batch.y[:, k] - predicted
        self.innovation_covariance = covariance[:, PARAMETERS:, PARAMETERS:] + self._output_noise
        k_joint = gain(covariance[:, :, PARAMETERS:], self.innovation_covariance)
        correction = apply(k_joint, self.innovation)
        self.w, self.x = self.w + correction[:, :PARAMETERS], predicted + correction[:, PARAMETERS:]
        self.covariance = covariance - k_joint @ self.innovation_covariance @ transposed(k_joint)
