"""Joint extended Kalman filter: one filter for parameters and state, z = [w; x].

Source: R. E. Kopp, R. J. Orford, "Linear regression applied to system identification for adaptive control systems",
AIAA Journal 1 (1963); H. Cox, "On the estimation of state variables and parameters for noisy dynamic systems", IEEE TAC
9 (1964); in the form of A. H. Jazwinski, "Stochastic processes and filtering theory", Academic Press (1970), ch. 8.

As its users would: started with what is known of the parameters and with the first sample as the state; derivatives are
exact to rounding; process and measurement noise as known; covariance P - K S Kᵀ; a missing output is skipped.
"""

from __future__ import annotations

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import OUTPUTS, PARAMETERS, STATES, Batch, Estimates
from .in_c import followed
from .recursion import (
    Slopes,
    apply,
    block_diagonal,
    gain,
    no_innovation,
    output_covariance,
    repeated,
    transposed,
    walk_covariance,
)

_SKIPPED = 1e6  # noise of a missing output is so many times what it is: it counts for nothing


def joint_ekf(batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Run over the whole batch."""
    return followed("JOINT_EKF", batch, at, JointEkf)


class Joint:
    """B filters on z = [w; x] in step (recursion.Recursion). Both outputs are the state: the update is linear."""

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
