"""Recursive least squares with exponential forgetting, on the model as a linear regression (regression.py).

Source: L. Ljung, T. Söderström, "Theory and practice of recursive identification", MIT Press (1983), ch. 2;
K. J. Åström, B. Wittenmark, "Adaptive control", Addison-Wesley (1995), ch. 2. With t = φᵀ q for each window:

    K = P φ / (λ r + φᵀ P φ);  q = q + K (t - φᵀ q);  P = (P - K φᵀ P) / λ,  λ = exp(-window / forgetting)

P / r is what is usually called P; so scaled it is the covariance of q as far as least squares knows: it takes the
noise for white and the parameters for constant. As its users would: started with what is known of the parameters, no
remedy against wind-up, and the defaults the best (within 5 %, error of m_p, c_p, k_p) of windows of 5 to 60 ms,
forgetting of 0.5 to 20 s and corners of 0 to 1 Hz, for both preloads, on 20 runs of 30 s of a lever whose parameters
walk by 1, 2, 2 % per √s, shaken by 0.1 g and 0.3 N m.

Regularised, it does not forget the first guess (S. Gunnarsson, "Combining tracking and regularization in recursive
least squares identification", IEEE CDC 1996): the information of each window is λ P⁻¹ + φ φᵀ / r + (1 - λ) P_0⁻¹.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..data import PARAMETERS, Batch, Estimates
from .regression import Equations, equations


@dataclass(frozen=True)
class Rls:
    """Learns once in `window` [s] from what is faster than `corner` [Hz]; what is `forgetting` [s] old counts 1/e.

    `regularised`: the first guess is not forgotten.
    """

    window: float = 0.02
    forgetting: float = 8.0
    corner: float = 1.0
    regularised: bool = False

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run recursive least squares over a batch; report at the samples `at`."""
        data = equations(batch, self.window, self.corner)
        forget = math.exp(-data.period / self.forgetting)
        shape = (batch.runs, len(data.ends) + 1)
        q, covariance = np.empty((*shape, PARAMETERS)), np.empty((*shape, PARAMETERS, PARAMETERS))
        q[:, 0], covariance[:, 0] = data.first_guess(batch.knowledge)
        if self.regularised:
            return data.estimates(at, batch.knowledge, *_regularised(data, forget, q, covariance))
        with np.errstate(over="ignore", invalid="ignore"):
            for j in range(len(data.ends)):
                phi, p = data.regressors[:, j], covariance[:, j]
                cross = _times(p, phi)
                error = data.target[:, j] - (phi * q[:, j]).sum(axis=1)
                k = cross / (forget * data.variance + (phi * cross).sum(axis=1))[:, np.newaxis]
                q[:, j + 1] = q[:, j] + k * error[:, np.newaxis]
                covariance[:, j + 1] = (p - k[:, :, np.newaxis] * cross[:, np.newaxis]) / forget
        return data.estimates(at, batch.knowledge, q, covariance)


def _times(matrices: Array, vectors: Array) -> Array:
    """Return (B, n, m) times (B, m)."""
    product: Array = (matrices @ vectors[:, :, np.newaxis])[:, :, 0]
    return product


def _regularised(data: Equations, forget: float, q: Array, covariance: Array) -> tuple[Array, Array]:
    """Fill q (B, J + 1, 3) and its covariance from their first entries on."""
    prior = np.linalg.inv(covariance[:, 0])
    information, vector = prior, _times(prior, q[:, 0])
    first = vector
    for j in range(len(data.ends)):
        phi = data.regressors[:, j]
        more = phi[:, :, np.newaxis] * phi[:, np.newaxis] / data.variance
        information = forget * information + more + (1.0 - forget) * prior
        vector = forget * vector + phi * data.target[:, j, np.newaxis] / data.variance + (1.0 - forget) * first
        covariance[:, j + 1] = np.linalg.inv(information)
        q[:, j + 1] = _times(covariance[:, j + 1], vector)
    return q, covariance
