"""What a Kalman filter would state that knew the true trajectory to linearise at: a reference for errors, not a bound.

For z = [w; x] of a run with additive Gaussian noise:

    P⁻ = F P Fᵀ + Q,   F = df/dz at the truth
    K = P⁻ Hᵀ (H P⁻ Hᵀ + R)⁻¹,   P = (I - K H) P⁻ (I - K H)ᵀ + K R Kᵀ

Each run has its own covariance, given its inputs and its truth; mean squares of errors are held against the mean of
these over runs. For a linear model this is the covariance of the Kalman filter and nobody does better. For ours it is
no lower bound: an estimator may do better, above all while the prior still counts. Its mean is never below the
posterior Cramér–Rao bound of the same ensemble (bound.py): a Schur complement is concave in the matrix it is taken of.

It starts as an estimator does: at the first sample, knowing theta and theta_dot as well as they are measured and w as
well as it is guessed. That the lever rests there is not used.
"""

from __future__ import annotations

from itertools import chain

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .data import PARAMETERS, Batch
from .transitions import (
    dynamics_gradient,
    initial_covariance,
    measured,
    process_covariance,
    transitions,
    true_parameters,
    with_dynamics,
)


def covariances(batch: Batch, at: NDArray[np.int64]) -> Array:
    """Return (B, T, 5, 5) of [w; theta, theta_dot] after the samples `at`, which rise.

    Raise ValueError where the truth is no member of the model.
    """
    process, noise = process_covariance(batch), np.diag(batch.knowledge.output_noise**2)
    p = np.tile(initial_covariance(batch), (batch.runs, 1, 1))
    kept, wanted = {0: p}, set(at.tolist())
    for k, transition in enumerate(chain.from_iterable(transitions(batch, int(at[-1]))), 1):
        p = measured(transition @ p @ transition.transpose(0, 2, 1) + process, noise)
        if k in wanted:
            kept[k] = p
    return np.stack([kept[k] for k in at.tolist()], axis=1)


def variances(batch: Batch, at: NDArray[np.int64], covariance: Array) -> Array:
    """Return (B, T, 5) of w and of natural frequency and damping ratio relative to the truth, of covariances().

    The latter two by the delta method. The squares of `scores.errors` are held against these.
    """
    w = batch.knowledge.scaled(true_parameters(batch)[:, at])
    return with_dynamics(covariance[..., :PARAMETERS, :PARAMETERS], dynamics_gradient(batch, at, w))
