"""Normalised innovations squared against what the right covariances give, from any number of pieces of a run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from lever_cdkf.host_tools.statistics import NORMAL_95, chi_square_quantile
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CHI_SQUARE_95 = {freedom: chi_square_quantile(0.95, freedom) for freedom in (1, 2)}
"""Value that chi-square with so many degrees of freedom stays below with a probability of 95 %."""


def freedom(theta_measured: FloatArray, theta_dot_measured: FloatArray) -> NDArray[np.int64]:
    """How many outputs each sample had."""
    outputs: NDArray[np.int64] = np.isfinite(theta_measured).astype(np.int64) + np.isfinite(theta_dot_measured)
    return outputs


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

    def figures(self) -> dict[str, Any]:
        """Mean, expected mean with its band, and the share inside the 95 % bound; null without samples."""
        if not self._count:
            return {"mean": None, "expected": None, "mean_band_95": None, "inside_95_percent": None}
        expected = self._freedom / self._count
        spread = NORMAL_95 * math.sqrt(2.0 * expected / self._count)
        return {
            "mean": self._nis / self._count,
            "expected": expected,
            "mean_band_95": [expected - spread, expected + spread],
            "inside_95_percent": self._inside / self._count,
        }
