"""Normalised innovations squared against what the right covariances give, from any number of pieces of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray
from ..numeric.quantiles import NORMAL_95, chi_square_quantile

CHI_SQUARE_95 = {freedom: chi_square_quantile(0.95, freedom) for freedom in (1, 2)}
"""Value that chi-square with so many degrees of freedom stays below with a probability of 95 %."""


def freedom(theta_measured: FloatArray, theta_dot_measured: FloatArray) -> NDArray[np.int64]:
    """Return how many outputs each sample had."""
    outputs: NDArray[np.int64] = np.isfinite(theta_measured).astype(np.int64) + np.isfinite(theta_dot_measured)
    return outputs


@dataclass(frozen=True)
class Nis:
    """Normalised innovation squared, of samples that had a measurement and an answer; None without any."""

    mean: float | None = None
    expected: float | None = None
    mean_band_95: list[float] | None = None
    """Where the mean of a consistent filter lies in 95 % of runs."""
    inside_95_percent: float | None = None
    """Share of the samples below their chi-square's 95 % value: 0.95 for a consistent filter."""


class Innovations:
    """Sums over all samples that had outputs."""

    def __init__(self) -> None:
        self._count = self._inside = 0
        self._nis = self._freedom = 0.0

    def add(self, nis: FloatArray, outputs: NDArray[np.int64]) -> None:
        """NIS of samples, and how many outputs each had."""
        used = (outputs > 0) & np.isfinite(nis)
        nis, outputs = nis[used], outputs[used]
        self._count += len(nis)
        self._nis += float(np.sum(nis))
        self._freedom += float(np.sum(outputs))
        self._inside += int(np.sum(nis <= np.where(outputs == 2, CHI_SQUARE_95[2], CHI_SQUARE_95[1])))

    def figures(self) -> Nis:
        """Return mean, band and share of what was added."""
        if not self._count:
            return Nis()
        expected = self._freedom / self._count
        spread = NORMAL_95 * math.sqrt(2.0 * expected / self._count)
        return Nis(
            mean=self._nis / self._count,
            expected=expected,
            mean_band_95=[expected - spread, expected + spread],
            inside_95_percent=self._inside / self._count,
        )


def verdict(nis: Nis) -> str:
    """Return what NIS says, in a sentence."""
    if nis.mean is None or nis.expected is None:
        return ""
    ratio = nis.mean / nis.expected
    size = "larger than" if ratio > 1.1 else "smaller than" if ratio < 0.9 else "as large as"
    numbers = f"mean NIS {nis.mean:.2f}, expected {nis.expected:.2f}"
    return f"Innovations are {size} the filter expects ({numbers})."
