"""How good estimates are: errors against references, stated against actual covariances; measures.py has the rest.

All functions are pure and take arrays with runs first and times second, so that a window of time is a slice. The tests
on normalised squares of errors (NEES) and of innovations (NIS) are those of Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
"Estimation with applications to tracking and navigation" (2001), section 5.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.numeric.quantiles import chi_square_band

from ..measures import rms
from .data import Batch, Estimates

# --- errors ----------------------------------------------------------------------------------------------------------


def errors(batch: Batch, estimates: Estimates) -> Array:
    """Return (B, T, 5) errors of w, and those of natural frequency and damping ratio relative to the truth.

    Those of w are NaN where the truth is no member of the model.
    """
    at, truth = estimates.at, batch.truth
    p = np.moveaxis(batch.knowledge.physical(estimates.w), -1, 0)
    dynamics = np.moveaxis(batch.model.dynamics(p, batch.rest(at)), 0, -1)
    relative = dynamics / truth.dynamics[:, at] - 1.0
    if truth.p is None:
        return np.concatenate((np.full_like(estimates.w, np.nan), relative), axis=-1)
    return np.concatenate((estimates.w - batch.knowledge.scaled(truth.p[:, at]), relative), axis=-1)


# --- against references ----------------------------------------------------------------------------------------------


def ratio(deviations: Array, variances: Array) -> Array:
    """Return (n,) rms of errors (B, T, n) ÷ root of the mean of variances (B, T, n) or (T, n).

    The variances are of linearised.py or bound.py.

    With the squares of another estimator's errors for `variances`: how the two compare. On the same data that ratio has
    the smaller spread, as most of what chance does, it does to both.
    """
    stated = np.broadcast_to(variances, deviations.shape)
    quotient: Array = rms(deviations, axis=(0, 1)) / np.sqrt(np.mean(stated, axis=(0, 1)))
    return quotient


def ratio_spread(deviations: Array, variances: Array, seed: int, draws: int = 2000) -> Array:
    """Return (n,) standard error of `ratio`, by drawing runs with replacement (B. Efron, Annals of Statistics 7, 1979).

    Times of one run depend on each other, so it is runs that are drawn. NaN for a single run.
    """
    square, least = (
        np.mean(np.broadcast_to(part, deviations.shape), axis=1) for part in (np.square(deviations), variances)
    )
    if len(square) < 2:
        return np.full(square.shape[1], np.nan)

    def quotient(square: Array, least: Array, axis: int) -> Array:
        root: Array = np.sqrt(square.mean(axis=axis) / least.mean(axis=axis))
        return root

    from scipy.stats import bootstrap  # which takes a third of a second

    drawn = bootstrap((square, least), quotient, paired=True, axis=0, n_resamples=draws, method="percentile", rng=seed)
    spread: Array = drawn.standard_error
    return spread


# --- consistency -----------------------------------------------------------------------------------------------------


def sigma_ratio(deviations: Array, variances: Array) -> Array:
    """Return (n,) what an estimator claims ÷ what it does.

    It is the root of the mean of its variances (B, T, n) ÷ rms of its errors.
    """
    return 1.0 / ratio(deviations, variances)


@dataclass(frozen=True)
class Consistency:
    """Normalised squares of several runs, against what they would be if the stated covariances were right."""

    expected: float
    """Degrees of freedom."""
    mean: float
    """Over runs and times."""
    mean_band: tuple[float, float]
    """Where the mean would lie in 95 % of batches, or more: times of one run depend on each other (consistency())."""
    inside: float
    """Share of times at which the mean over runs lies in its chi-square's 95 % band; 0.95 on average."""


def consistency(squares: Array, freedom: int) -> Consistency:
    """Return the consistency of NEES or NIS (B, T), each expected to be chi-square with `freedom` degrees of freedom.

    The mean over B runs at one time lies in the band of chi-square with B `freedom` degrees of freedom, ÷ B. That is
    taken for the band of the mean over all times as well: right where a run's squares hardly change in time, and wider
    than need be where they do.
    """
    low, high = (edge / len(squares) for edge in chi_square_band(freedom * len(squares)))
    over_runs = squares.mean(axis=0)
    inside = np.mean((over_runs >= low) & (over_runs <= high))
    return Consistency(float(freedom), float(squares.mean()), (low, high), float(inside))


# --- convergence -----------------------------------------------------------------------------------------------------


def median_and_worst(times: Array) -> tuple[float, float]:
    """Return the median and worst of settling times (B,) with NaN for never: each is NaN when it is never."""
    settled = np.where(np.isnan(times), np.inf, times)
    middle, worst = float(np.median(settled)), float(settled.max())
    return (middle if math.isfinite(middle) else math.nan), (worst if math.isfinite(worst) else math.nan)
