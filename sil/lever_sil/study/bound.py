"""The least mean square error that any estimator can have over a whole ensemble of runs: posterior Cramér–Rao bound.

P. Tichavský, C. Muravchik, A. Nehorai, "Posterior Cramér–Rao bounds for discrete-time nonlinear filtering", IEEE Trans.
Signal Processing 46 (1998), eq. 21, for z = [w; x] with additive Gaussian noise; E is over trajectories:

    J⁺ = Q⁻¹ + Hᵀ R⁻¹ H - Q⁻¹ E[F] (J + E[Fᵀ Q⁻¹ F])⁻¹ E[F]ᵀ Q⁻¹,   F = df/dz at the truth

*How it is computed.* Let C = E[(F - E[F])ᵀ Q⁻¹ (F - E[F])]. By the matrix inversion lemma, with P = J⁻¹:

    P⁻ = E[F] (P⁻¹ + C)⁻¹ E[F]ᵀ + Q,   then the measurement update of a Kalman filter with H and R

so that Q⁻¹, which does not exist where a parameter has no walk, is needed of the states alone: F varies in their rows
only. E is the mean over the runs of a batch, C with the divisor B - 1. Inputs differ from run to run and every
estimator knows them; they are part of what E is over.

*How tight it is.* An estimator rarely reaches it. C counts what is learnt of w as if theta and theta_dot were known
without error. And it is information that is averaged over runs, where runs with much of it count most; in the mean of
squared errors it is runs with little of it. An error of twice the bound is no sign of a bad estimator.

*What it is a bound of.* The prior is N(guess, sigma²) of w and N(y_0, R) of the first state. In a matched run the lever
is at rest first, and runs that leave the model's bounds are drawn again (matched.py): that is not counted here.
"""

from __future__ import annotations

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .data import PARAMETERS, Batch
from .transitions import (
    SIZE,
    dynamics_gradient,
    initial_covariance,
    measured,
    process_covariance,
    transitions,
    true_parameters,
    with_dynamics,
)


def posterior_cramer_rao(batch: Batch, at: NDArray[np.int64]) -> Array:
    """Return (T, 5, 5) bound of the covariance of errors of [w; theta, theta_dot] after the samples `at`, which rise.

    Raises ValueError where the truth is no member of the model, or where the states have no process noise.
    """
    if batch.knowledge.process_noise <= 0.0:
        raise ValueError("the posterior Cramér-Rao bound needs process noise: without it, it is 0")
    process, noise = process_covariance(batch), np.diag(batch.knowledge.output_noise**2)
    weight = np.linalg.inv(process[PARAMETERS:, PARAMETERS:])
    p = initial_covariance(batch)
    kept, wanted, k = {0: p}, set(at.tolist()), 0
    for block in transitions(batch, int(at[-1])):
        for mean, c in zip(*_moments(block, weight), strict=True):
            k += 1
            sharpened = p @ np.linalg.inv(np.eye(SIZE) + c @ p)
            p = measured((mean @ sharpened @ mean.T + process)[np.newaxis], noise)[0]
            if k in wanted:
                kept[k] = p
    return np.stack([kept[k] for k in at.tolist()])


def _moments(block: Array, weight: Array) -> tuple[Array, Array]:
    """E[F] and C (n, 5, 5) of F (n, B, 5, 5); `weight` (2, 2) is the states' Q⁻¹."""
    mean = block.mean(axis=1)
    varying = (block - mean[:, np.newaxis])[:, :, PARAMETERS:]
    c = np.einsum("nbai,nbaj->nij", varying, weight @ varying, optimize=True)
    return mean, c / max(block.shape[1] - 1, 1)


def variances(batch: Batch, at: NDArray[np.int64], covariance: Array) -> Array:
    """Return (T, 5) of w, natural frequency and damping ratio, the latter two relative, of posterior_cramer_rao().

    The bound of a function is that of z through the mean of its gradient over trajectories.
    """
    w = batch.knowledge.scaled(true_parameters(batch)[:, at])
    return with_dynamics(covariance[:, :PARAMETERS, :PARAMETERS], dynamics_gradient(batch, at, w).mean(axis=0))
