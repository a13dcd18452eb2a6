"""How good estimates are, for every table.

It is told by errors, coverage, time to settle, consistency, and for how long an error goes without a flag.

All functions are pure. Errors are estimate minus truth, or relative to it; `axis` is that of numpy: over what is taken
together, all of it by default.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import Array, BoolArray
from lever_cdkf.numeric.stretches import runs
from numpy.typing import NDArray

WRONG = 3.0
"""An error of more standard deviations is wrong, unless it is flagged."""

Axis = int | tuple[int, ...] | None


def rms(errors: NDArray[Any], axis: Axis = None) -> Any:
    """Return the root mean square of real or complex errors."""
    return np.sqrt(np.mean(np.square(np.abs(errors)), axis=axis))


def covered(errors: Array, sigma: Array, axis: Axis = None) -> Any:
    """Return the share of errors within ±2 of the stated standard deviations: about 0.95 if these are right."""
    return np.mean(np.abs(errors) <= 2.0 * sigma, axis=axis)


def settling_times(errors: Array, elapsed: Array, within: float = 0.05) -> Array:
    """Return (B,) time [s] from which on each run's |error| (B, T) stays <= `within` to the end; NaN if it never does.

    `elapsed` (T,) [s] counts from the change that is to be followed; what lies before it does not matter. A time
    without an estimate (NaN) counts as outside.
    """
    after = elapsed >= 0.0
    if not after.any():
        return np.full(len(errors), np.nan)
    outside = ~(np.abs(errors[:, after]) <= within)
    backwards = outside[:, ::-1]
    first = np.where(outside.any(axis=1), backwards.shape[1] - backwards.argmax(axis=1), 0)
    times: Array = np.append(elapsed[after], np.nan)[first]
    return times


def is_flagged(faults: NDArray[Any], mask: int) -> BoolArray:
    """Return where the firmware shows any of these faults; DO_NOT_TRUST has those that forbid to trust estimates."""
    shown: BoolArray = (faults.astype(np.int64) & mask) != 0
    return shown


def longest(true: BoolArray) -> int:
    """Return how many of `true` (T,) are true in a row, at most."""
    return max((last - first + 1 for first, last in runs(true)), default=0)


def covariance_of(sigma: Array, correlation: Array) -> Array:
    """Return (..., 3, 3) of standard deviations (..., 3) and correlations (..., 3).

    The correlations are those of the first and second, the first and third, the second and third.
    """
    matrix = np.zeros((*sigma.shape, 3))
    matrix[..., range(3), range(3)] = 1.0
    for index, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        matrix[..., i, j] = matrix[..., j, i] = correlation[..., index]
    covariance: Array = matrix * sigma[..., :, None] * sigma[..., None, :]
    return covariance


def normalised_squares(errors: Array, covariance: Array) -> Array:
    """Return (...) eᵀ P⁻¹ e of errors (..., n) with stated covariances (..., n, n): NEES.

    It is infinite for a singular one.
    """
    regular = np.linalg.slogdet(covariance).sign != 0.0
    invertible = np.where(regular[..., None, None], covariance, np.eye(covariance.shape[-1]))
    solved = np.linalg.solve(invertible, errors[..., None])[..., 0]
    return np.where(regular, np.einsum("...i,...i->...", errors, solved), np.inf)


def first_without(true: BoolArray, count: int) -> Any:
    """Return (...) where along (..., T) the first `count` in a row that are not true begin.

    It is infinite where there are none.
    """
    blocked = np.lib.stride_tricks.sliding_window_view(true, count, axis=-1).any(axis=-1)
    return np.where(blocked.all(axis=-1), np.inf, blocked.argmin(axis=-1))
