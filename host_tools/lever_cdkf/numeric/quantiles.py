"""Quantiles of the distributions that errors and innovations are judged by; to ten digits, without SciPy."""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist


def normal_quantile(probability: float) -> float:
    """Return what a normal deviate stays below with this probability."""
    return NormalDist().inv_cdf(probability)


NORMAL_95 = normal_quantile(0.975)
"""A normal deviate is within plus and minus this with a probability of 95 %."""


@cache
def chi_square_quantile(probability: float, freedom: int) -> float:
    """Return what chi-square with so many degrees of freedom stays below with this probability."""
    low, high = 0.0, float(freedom)
    while _chi_square_exceeds(high, freedom) > 1.0 - probability:
        low, high = high, 2.0 * high
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        if _chi_square_exceeds(middle, freedom) > 1.0 - probability:
            low = middle
        else:
            high = middle
    return high


def chi_square_band(freedom: int) -> tuple[float, float]:
    """Return the middle 95 % of chi-square."""
    return chi_square_quantile(0.025, freedom), chi_square_quantile(0.975, freedom)


def _chi_square_exceeds(x: float, freedom: int) -> float:
    """Return the probability that chi-square is above x > 0.

    It is a finite sum (M. Abramowitz, I. A. Stegun, 26.4.4 and 26.4.5).
    """
    half, power = 0.5 * x, 0.5 * freedom - 1.0
    term = math.exp(power * math.log(half) - half - math.lgamma(power + 1.0))
    total = math.erfc(math.sqrt(half)) if freedom % 2 else 0.0
    while power >= 0.0:
        total += term
        term *= power / half
        power -= 1.0
    return total
