"""Measured coherence of two signals: how much of one, at each frequency, is a linear answer to the other.

1 is all of it. It needs no model, so it says where a transfer function can be measured at all: noise, a second input
(the motor's dither, the pilot's intent) and nonlinearity lower it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray

WINDOW = 2.0
"""[s]: half a hertz between frequencies."""


class Coherence:
    """|S_xy|² / (S_xx S_yy) of samples as they come, by half-overlapping Hann windows.

    P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967). As scipy.signal.coherence, which takes all samples at once,
    and longer to import than a report to write. Gaps (NaN) count as the mean of their window.
    """

    def __init__(self, sample_period: float, seconds: float = WINDOW) -> None:
        self._period = sample_period
        self._length = max(2, round(seconds / sample_period))
        bins = self._length // 2 + 1
        self._rest = np.zeros((2, 0))
        self._power = np.zeros((2, bins))
        self._cross = np.zeros(bins, dtype=np.complex128)
        self.windows = 0
        """How many are averaged."""

    def add(self, x: NDArray[Any], y: NDArray[Any]) -> None:
        """Further samples of both."""
        joined, hop = np.hstack((self._rest, np.stack((x, y)))), self._length // 2
        if joined.shape[1] < self._length:
            self._rest = joined
            return
        cut = np.lib.stride_tricks.sliding_window_view(joined, self._length, axis=1)[:, ::hop]
        transformed = np.fft.rfft(_without_mean(cut) * _hann(self._length), axis=2)
        self._power += (np.abs(transformed) ** 2).sum(axis=1)
        self._cross += (transformed[0].conj() * transformed[1]).sum(axis=0)
        self.windows += cut.shape[1]
        self._rest = joined[:, cut.shape[1] * hop :].copy()

    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Return frequencies [Hz] and coherence [1].

        NaN where a signal has no power, and with fewer than two windows.
        """
        frequency: FloatArray = np.fft.rfftfreq(self._length, self._period).astype(np.float64)
        coherence: FloatArray = np.full(len(frequency), np.nan)
        power = self._power.prod(axis=0)
        if self.windows > 1:
            np.divide(np.abs(self._cross) ** 2, power, out=coherence, where=power > 0.0)
        return frequency, coherence

    def chance(self) -> float:
        """Return what unrelated signals stay below at 95 % of the frequencies [1]; windows count as independent."""
        return 1.0 - 0.05 ** (1.0 / (self.windows - 1)) if self.windows > 1 else 1.0


def _hann(length: int) -> FloatArray:
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)


def _without_mean(windows: FloatArray) -> FloatArray:
    finite = np.isfinite(windows)
    count = np.maximum(finite.sum(axis=-1, keepdims=True), 1)
    mean = np.where(finite, windows, 0.0).sum(axis=-1, keepdims=True) / count
    return np.where(finite, windows - mean, 0.0)
