"""A test for whiteness: the autocorrelation of the residual of theta_dot.

A Kalman filter whose model is right has white innovations (Kailath 1968), and with a settled gain its residual,
measured minus estimated, is white with them: it is R / S times the innovation. A model that is wrong leaves something
of the motion in both. At 1 kHz that is far below the noise of a sample, and NIS does not see it; averages over 20 ms
show it, as the motion stays alike in that time and the noise does not.

The test sees motion, and torque, that the model lacks. It does not see an error that the parameters absorb: friction in
the lever, a gain or a delay of a sensor. Residuals stay white then, and the parameters are biased.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..numeric.arrays import FloatArray
from ..numeric.quantiles import NORMAL_95, normal_quantile

AVERAGE = 0.02
"""Time over which the residual is averaged [s]."""
LAGS = 25
"""Lags looked at, in averages: 20 ms to 0.5 s, a period of 2 Hz."""
COLOURED = 0.2
"""A correlation that is not put down to chance or tuning. Seen: models that are right leave 0.05 to 0.11 in 40 s, those
that are asked for the pilots of two_dof and hand 0.5."""
CANNOT_SEE = "That test does not see friction in the lever, nor gain and delay of a sensor: these bias the parameters."
"""For every verdict that finds no colour."""

_ALL_95 = normal_quantile(0.5 + 0.5 * 0.95 ** (1.0 / LAGS))
"""LAGS normal deviates are all within plus and minus this with a probability of 95 %."""


@dataclass(frozen=True)
class Whiteness:
    """What summary.json says of it."""

    average_s: float
    autocorrelation: list[float]
    """At lags of 1, 2, … LAGS averages."""
    band_95: float
    """White noise stays within plus and minus this at 95 % of the lags."""
    largest: float
    """The correlation that is farthest from 0."""
    largest_after_s: float
    """Its lag."""
    white: bool
    """Whether no correlation is beyond what chance, or tuning (COLOURED), explains."""

    @property
    def band_of_all(self) -> float:
        """White noise stays within plus and minus this at all lags, with a probability of 95 %."""
        return self.band_95 * _ALL_95 / NORMAL_95


def residual(trace: Mapping[str, FloatArray]) -> FloatArray | None:
    """Measured minus estimated theta_dot [rad/s] of a trace; None where it has not both."""
    measured, estimate = (trace.get(f"theta_dot_{kind}_rad_s") for kind in ("measured", "estimate"))
    return None if measured is None or estimate is None else measured - estimate


def measure(values: FloatArray, period: float) -> Whiteness | None:
    """Of a residual at samples `period` [s] apart, NaN where there is none; None when it is too short to tell."""
    size = average_size(period)
    return of_averages(averages(values, size), size * period)


def average_size(period: float) -> int:
    """Return samples in an average."""
    return max(1, round(AVERAGE / period))


def of_averages(averages: FloatArray, step: float) -> Whiteness | None:
    """measure() from averages that are `step` [s] apart."""
    finite = np.isfinite(averages)
    count = int(finite.sum())
    if count < 4 * LAGS:
        return None
    centred = np.where(finite, averages - np.mean(averages[finite]), 0.0)
    variance = float(np.sum(np.square(centred))) / count
    if variance == 0.0:
        return None
    pairs = [max(1, int(np.sum(finite[lag:] & finite[:-lag]))) for lag in range(1, LAGS + 1)]
    products = [float(centred[lag:] @ centred[:-lag]) for lag in range(1, LAGS + 1)]
    correlation = [product / pair / variance for product, pair in zip(products, pairs, strict=True)]
    largest = max(range(LAGS), key=lambda index: abs(correlation[index]))
    return Whiteness(
        average_s=step,
        autocorrelation=correlation,
        band_95=NORMAL_95 / math.sqrt(count),
        largest=correlation[largest],
        largest_after_s=(largest + 1) * step,
        white=all(
            abs(r) <= max(COLOURED, _ALL_95 / math.sqrt(pair)) for r, pair in zip(correlation, pairs, strict=True)
        ),
    )


def averages(values: FloatArray, size: int) -> FloatArray:
    """Return the averages of `size` values each; NaN where more than half are."""
    rows = values[: len(values) // size * size].reshape(-1, size)
    finite = np.isfinite(rows)
    count = finite.sum(axis=1)
    total = np.where(finite, rows, 0.0).sum(axis=1)
    means: FloatArray = np.where(2 * count >= size, total / np.maximum(count, 1), np.nan)
    return means


def verdict(measured: Whiteness | None) -> str:
    """Return what the autocorrelation of the residual says, and what it cannot see."""
    if measured is None:
        return ""
    size = f"{measured.largest:.2f} after {1000.0 * measured.largest_after_s:.0f} ms"
    chance = f"chance alone: within ±{measured.band_of_all:.2f}"
    if not measured.white:
        return (
            f"Residuals of the rate are coloured (correlation {size}; {chance}): the arm, or a sensor, is not what the "
            "model assumes."
        )
    if abs(measured.largest) <= measured.band_of_all:
        last = measured.average_s * len(measured.autocorrelation)
        return f"Residuals of the rate are white up to a lag of {last:g} s ({chance}). {CANNOT_SEE}"
    return (
        f"Residuals of the rate are slightly correlated ({size}; {chance}), below the {COLOURED:g} from which on the "
        f"model counts as wrong. {CANNOT_SEE}"
    )
