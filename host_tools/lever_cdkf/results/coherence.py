"""Measured coherence of two signals: how much of one, at each frequency, is a linear answer to the other.

1 is all of it. It needs no model, so it says where a transfer function can be measured at all: noise, a second input
(the motor's dither, the pilot's intent) and nonlinearity lower it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray
from ..numeric.windows import Windows

WINDOW = 2.0
"""[s]: half a hertz between frequencies."""


class Coherence:
    """|S_xy|² / (S_xx S_yy) of samples as they come."""

    def __init__(self, sample_period: float, seconds: float = WINDOW) -> None:
        self._period = sample_period
        self._windows = Windows(2, max(2, round(seconds / sample_period)))
        bins = self._windows.length // 2 + 1
        self._power = np.zeros((2, bins))
        self._cross = np.zeros(bins, dtype=np.complex128)

    @property
    def windows(self) -> int:
        """How many are averaged."""
        return self._windows.count

    def add(self, x: NDArray[Any], y: NDArray[Any]) -> None:
        """Further samples of both."""
        transformed = self._windows.add(x, y)
        self._power += (np.abs(transformed) ** 2).sum(axis=1)
        self._cross += (transformed[0].conj() * transformed[1]).sum(axis=0)

    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Return frequencies [Hz] and coherence [1].

        NaN where a signal has no power, and with fewer than two windows.
        """
        frequency: FloatArray = np.fft.rfftfreq(self._windows.length, self._period).astype(np.float64)
        coherence: FloatArray = np.full(len(frequency), np.nan)
        power = self._power.prod(axis=0)
        if self.windows > 1:
            np.divide(np.abs(self._cross) ** 2, power, out=coherence, where=power > 0.0)
        return frequency, coherence

    def chance(self) -> float:
        """Return what unrelated signals stay below at 95 % of the frequencies [1]; windows count as independent."""
        return 1.0 - 0.05 ** (1.0 / (self.windows - 1)) if self.windows > 1 else 1.0
