"""How good estimates are: errors against the bound, honesty of the stated covariances, time to converge.

All functions are pure and take arrays with runs first and times second, so that a window of time is a slice. The tests
on normalised squares of errors (NEES) and of innovations (NIS) are those of Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
"Estimation with applications to tracking and navigation" (2001), section 5.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from ..oracle.cdkf import Array
from .data import Batch, Estimates

_BISECTIONS = 100  # halvings of an interval: to the last bit


# --- errors ----------------------------------------------------------------------------------------------------------


def errors(batch: Batch, estimates: Estimates) -> Array:
    """(B, T, 5) errors of w, and those of natural frequency and damping ratio relative to the truth.

    Those of w are NaN where the truth is no member of the model.
    """
    at, truth = estimates.at, batch.truth
    p = np.moveaxis(batch.knowledge.physical(estimates.w), -1, 0)
    dynamics = np.moveaxis(batch.model.dynamics(p, batch.rest(at)), 0, -1)
    relative = dynamics / truth.dynamics[:, at] - 1.0
    if truth.p is None:
        return np.concatenate((np.full_like(estimates.w, np.nan), relative), axis=-1)
    return np.concatenate((estimates.w - batch.knowledge.scaled(truth.p[:, at]), relative), axis=-1)


def rms(deviations: Array) -> Array:
    """(n,) over runs and times of errors (B, T, n)."""
    mean: Array = np.sqrt(np.mean(np.square(deviations), axis=(0, 1)))
    return mean


# --- against the bound -----------------------------------------------------------------------------------------------


def ratio(deviations: Array, variances: Array) -> Array:
    """(n,) rms of errors (B, T, n) ÷ root of the mean of their least variances (bound.variances).

    With the squares of another estimator's errors for `variances`: how the two compare. On the same data that ratio has
    the smaller spread, as most of what chance does, it does to both.
    """
    quotient: Array = rms(deviations) / np.sqrt(np.mean(variances, axis=(0, 1)))
    return quotient


def ratio_spread(deviations: Array, variances: Array, seed: int, draws: int = 2000) -> Array:
    """(n,) standard error of `ratio`, by drawing runs with replacement (B. Efron, Annals of Statistics 7, 1979).

    Times of one run depend on each other, so it is runs that are drawn.
    """
    square, least = (np.mean(part, axis=1) for part in (np.square(deviations), variances))
    drawn = np.random.default_rng(seed).integers(len(square), size=(draws, len(square)))
    spread: Array = np.std(np.sqrt(square[drawn].mean(axis=1) / least[drawn].mean(axis=1)), axis=0, ddof=1)
    return spread


# --- honesty ---------------------------------------------------------------------------------------------------------


def honesty(deviations: Array, variances: Array) -> Array:
    """(n,) what an estimator claims ÷ what it does: root of the mean of its variances (B, T, n) ÷ rms of its errors."""
    return 1.0 / ratio(deviations, variances)


def normalised_squares(deviations: Array, covariance: Array) -> Array:
    """(B, T) eᵀ P⁻¹ e of errors (B, T, n) with stated covariances (B, T, n, n): NEES."""
    squares: Array = np.einsum("bti,bti->bt", deviations, np.linalg.solve(covariance, deviations[..., None])[..., 0])
    return squares


@dataclass(frozen=True)
class Consistency:
    """Normalised squares of several runs, against what they would be if the stated covariances were right."""

    expected: float
    """Degrees of freedom."""
    mean: float
    """Over runs and times."""
    mean_band: tuple[float, float]
    """Where the mean would lie in 95 % of batches."""
    inside: float
    """Share of times at which the mean over runs lies in its chi-square's 95 % band; 0.95 on average."""

    @property
    def consistent(self) -> bool:
        """Whether the mean lies in its band."""
        return self.mean_band[0] <= self.mean <= self.mean_band[1]


def consistency(squares: Array, freedom: int) -> Consistency:
    """Of NEES or NIS (B, T), at least two runs, each expected to be chi-square with `freedom` degrees of freedom.

    Times of one run depend on each other, runs do not: so the mean's band is `freedom` ± Student's t for the means of
    the runs, with the spread that those have.
    """
    runs = len(squares)
    low, high = chi_square_band(freedom * runs)
    over_runs, over_times = squares.mean(axis=0), squares.mean(axis=1)
    half = student_95(runs - 1) * float(over_times.std(ddof=1)) / math.sqrt(runs)
    inside = np.mean((over_runs >= low / runs) & (over_runs <= high / runs))
    return Consistency(float(freedom), float(squares.mean()), (freedom - half, freedom + half), float(inside))


def chi_square_band(freedom: int) -> tuple[float, float]:
    """The middle 95 % of chi-square."""
    return _chi_square_quantile(0.025, freedom), _chi_square_quantile(0.975, freedom)


def _chi_square_quantile(probability: float, freedom: int) -> float:
    low, high = 0.0, freedom + 20.0 * math.sqrt(2.0 * freedom) + 20.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _chi_square_tail(middle, freedom) > 1.0 - probability else (low, middle)
    return 0.5 * (low + high)


def _chi_square_tail(value: float, freedom: int) -> float:
    """Probability of more than `value`: Poisson's sum if `freedom` is even, with half powers and erfc if it is odd
    (Abramowitz and Stegun 1964, 26.4.4 and 26.4.5)."""
    half, start = 0.5 * value, 0.5 * (freedom % 2)
    if half == 0.0:
        return 1.0
    powers = (start + index for index in range(freedom // 2))
    terms = (math.exp(power * math.log(half) - half - math.lgamma(power + 1.0)) for power in powers)
    return math.fsum(terms) + (math.erfc(math.sqrt(half)) if start else 0.0)


def student_95(freedom: int) -> float:
    """What the magnitude of Student's t exceeds in 5 %, right to 0.2 % from 3 degrees of freedom on.

    Fisher's expansion about the normal value (Abramowitz and Stegun 1964, 26.7.5).
    """
    x = NormalDist().inv_cdf(0.975)
    terms: tuple[float, ...] = (
        x,
        (x**3 + x) / 4.0,
        (5.0 * x**5 + 16.0 * x**3 + 3.0 * x) / 96.0,
        (3.0 * x**7 + 19.0 * x**5 + 17.0 * x**3 - 15.0 * x) / 384.0,
        (79.0 * x**9 + 776.0 * x**7 + 1482.0 * x**5 - 1920.0 * x**3 - 945.0 * x) / 92160.0,
    )
    return math.fsum(term / float(freedom**power) for power, term in enumerate(terms))


# --- convergence -----------------------------------------------------------------------------------------------------


def settling_times(relative: Array, elapsed: Array, within: float = 0.05) -> Array:
    """(B,) time [s] from which on each run's |error| (B, T) stays <= `within` to the end; NaN if it never does.

    `elapsed` (T,) [s] counts from the change that is to be followed; what lies before it does not matter. A time
    without an estimate (NaN) counts as outside.
    """
    after = elapsed >= 0.0
    outside = ~(np.abs(relative[:, after]) <= within)
    backwards = outside[:, ::-1]
    first = np.where(outside.any(axis=1), backwards.shape[1] - backwards.argmax(axis=1), 0)
    times: Array = np.append(elapsed[after], np.nan)[first]
    return times


def median_and_worst(times: Array) -> tuple[float, float]:
    """Of settling times (B,) with NaN for never: each is NaN when it is never."""
    known = np.where(np.isnan(times), np.inf, times)
    middle, worst = float(np.median(known)), float(known.max())
    return (middle if math.isfinite(middle) else math.nan), (worst if math.isfinite(worst) else math.nan)
