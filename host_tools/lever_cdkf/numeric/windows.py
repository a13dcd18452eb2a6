"""Fourier transforms of windows of signals, from which spectra and coherence are averaged.

P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967). As scipy.signal has it, which takes all samples at once, and
longer to import than a report to write.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array, ComplexArray, FloatArray


class Windows:
    """Half-overlapping Hann windows of signals, as their samples come. Gaps (NaN) count as the mean of their window."""

    def __init__(self, signals: int, length: int) -> None:
        self.length = length
        """Samples in a window."""
        self.count = 0
        """Windows so far."""
        self.rest = np.zeros((signals, 0))
        """Samples that no window has come to its end with, a row a signal."""

    def add(self, *signals: Array) -> ComplexArray:
        """Return the transforms (signals, windows, frequencies) of the windows that further samples complete."""
        joined, hop = np.hstack((self.rest, np.stack(signals))), max(1, self.length // 2)
        if joined.shape[1] < self.length:
            self.rest = joined
            return np.zeros((len(signals), 0, self.length // 2 + 1), dtype=np.complex128)
        cut = np.lib.stride_tricks.sliding_window_view(joined, self.length, axis=1)[:, ::hop]
        self.count += cut.shape[1]
        self.rest = joined[:, cut.shape[1] * hop :].copy()
        return transform(cut)


def transform(windows: FloatArray) -> ComplexArray:
    """Return the transforms of windows of samples along their last axis."""
    finite = np.isfinite(windows)
    count = np.maximum(finite.sum(axis=-1, keepdims=True), 1)
    mean = np.where(finite, windows, 0.0).sum(axis=-1, keepdims=True) / count
    return np.fft.rfft(np.where(finite, windows - mean, 0.0) * hann(windows.shape[-1]), axis=-1)


def hann(length: int) -> FloatArray:
    """Return the weights of the samples in a window."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
