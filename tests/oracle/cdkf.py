"""The square-root Central Difference Kalman Filter, for any model with additive noise.

Sources: M. Nørgaard, N. K. Poulsen, O. Ravn, "New developments in state estimation for nonlinear systems", Automatica
36 (2000): the divided differences; K. Ito, K. Xiong, "Gaussian filters for nonlinear filtering problems", IEEE TAC 45
(2000): the same as a Gaussian filter; R. van der Merwe, "Sigma-point Kalman filters for probabilistic inference", PhD
thesis, OGI (2004): the square-root form and the parameter filter.

A Gaussian belief is a mean `x` of shape (n,) and a lower-triangular factor `factor` of shape (n, n) with
covariance = factor factorᵀ. Sigma points are the 2n + 1 columns of an array: [x, x + h S, x - h S].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array

Function = Callable[[Array], Array]

H_SQUARED = 3.0  # the kurtosis of a Gaussian: the best central-difference step (Nørgaard et al. 2000)
H = H_SQUARED**0.5
C1 = 1.0 / (2.0 * H)  # weight of first differences
C2 = (H_SQUARED - 1.0) ** 0.5 / (2.0 * H_SQUARED)  # weight of second differences


@dataclass(frozen=True)
class Measurement:
    """What a belief predicts for an output of m values, and the covariance of the innovation."""

    mean: Array  # (m,) expected output
    first: Array  # (m, n) C, first differences: the part that is linear in the state
    second: Array  # (m, n) D, second differences: the error of that linearity
    noise: Array  # (m, m) factor of the output's noise
    factor: Array  # (m, m) S_y, factor of the innovation's covariance


def tria(matrix: Array) -> Array:
    """Return the lower-triangular S with S Sᵀ = A Aᵀ and diagonal >= 0, of an A of shape (n, k >= n)."""
    upper: Array = np.asarray(np.linalg.qr(matrix.T, mode="r"))
    # QR leaves the sign of each row of R open. The whole row turns with its diagonal, or S Sᵀ would change.
    lower: Array = upper.T * np.where(upper.diagonal() < 0.0, -1.0, 1.0)
    return lower


def draw(mean: Array, factor: Array) -> Array:
    """Return the sigma points of a belief, shape (n, 2n + 1)."""
    centre = mean[:, np.newaxis]
    offset = H * factor
    return np.concatenate((centre, centre + offset, centre - offset), axis=1)


def differences(values: Array) -> tuple[Array, Array, Array]:
    """Mean, C and D of a function's values at the sigma points, shape (m, 2n + 1): C Cᵀ + D Dᵀ is their covariance.

    Weights of the mean: (h² - n)/h² for the centre, 1/(2h²) for each other point.
    """
    n = values.shape[1] // 2
    centre, plus, minus = values[:, 0], values[:, 1 : n + 1], values[:, n + 1 :]
    both = plus + minus
    mean = ((H_SQUARED - n) * centre + 0.5 * both.sum(axis=1)) / H_SQUARED
    return mean, C1 * (plus - minus), C2 * (both - 2.0 * centre[:, np.newaxis])


def predict(mean: Array, factor: Array, step: Function, noise: Array) -> tuple[Array, Array]:
    """Return the belief after `step`, to which noise with the factor `noise` (n, n) is added."""
    predicted, first, second = differences(step(draw(mean, factor)))
    return predicted, tria(np.concatenate((first, second, noise), axis=1))


def measure(mean: Array, factor: Array, output: Function, noise: Array) -> Measurement:
    """Return what the belief predicts for `output`, to which noise with the factor `noise` (m, m) is added."""
    expected, first, second = differences(output(draw(mean, factor)))
    return Measurement(expected, first, second, noise, tria(np.concatenate((first, second, noise), axis=1)))


def gain(factor: Array, measurement: Measurement) -> Array:
    """K = (S Cᵀ / S_yᵀ) / S_y, shape (n, m): S Cᵀ is the covariance of state and output."""
    whitened = np.linalg.solve(measurement.factor, measurement.first @ factor.T)
    k: Array = np.linalg.solve(measurement.factor.T, whitened).T
    return k


def update(mean: Array, factor: Array, measurement: Measurement, k: Array, innovation: Array) -> tuple[Array, Array]:
    """Return the belief after seeing the output, in the square-root Joseph form.

    S⁺ S⁺ᵀ = (S - K C)(S - K C)ᵀ + K D Dᵀ Kᵀ + K N Nᵀ Kᵀ is a sum of squares whatever K is, so it cannot lose its
    factor; the usual downdate S Sᵀ - K S_y S_yᵀ Kᵀ can.
    """
    joseph = (factor - k @ measurement.first, k @ measurement.second, k @ measurement.noise)
    return mean + k @ innovation, tria(np.concatenate(joseph, axis=1))


def normalised_square(factor: Array, innovation: Array) -> float:
    """Return normalised innovation squared νᵀ (S_y S_yᵀ)⁻¹ ν: chi-square with m degrees of freedom if consistent."""
    whitened = np.linalg.solve(factor, innovation)
    return float(whitened @ whitened)


def deviations(factor: Array) -> Array:
    """Return standard deviation of each element of a belief: the lengths of the factor's rows."""
    lengths: Array = np.sqrt(np.einsum("ij,ij->i", factor, factor))
    return lengths
