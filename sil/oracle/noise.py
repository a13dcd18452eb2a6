"""Measurement and process noise, estimated from windows of innovations.

Measurement noise by covariance matching (A. H. Mohamed, K. P. Schwarz, "Adaptive Kalman filtering for INS/GPS", Journal
of Geodesy 73, 1999); process noise from what is left of past corrections in the innovations (R. K. Mehra, "On the
identification of variances and adaptive Kalman filtering", IEEE TAC 15, 1970).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .belief import Innovation
from .cdkf import Array

SAMPLES_LEAST = 20  # of an output
FAR = 0.5  # a factor further than this from 1 is done at once, up to STEP_MOST; of a nearer one SHARE
STEP_MOST = 10.0
SHARE = 0.2
STARVED = 1.15  # times the gain, from which on it is the process noise that is too small
OUTLIERS = 3.0  # innovations so many times too large are never those of process noise


class NoiseEstimation:
    """`output_noise` (2,) and `process_noise` of θ̇ are standard deviations, which end_block() changes."""

    def __init__(self, settings: Mapping[str, float]) -> None:
        self.window, self.range = settings["noise_window"], settings["noise_range"]
        self.output_set = np.array((settings["theta_noise"], settings["theta_dot_noise"]))
        self.process_set = settings["theta_dot_process_noise"]
        self.output_noise = self.output_set.copy()
        self.process_noise = self.process_set
        self.begin()

    def begin(self) -> None:
        """A new window."""
        self.elapsed = np.float32(0.0)
        self.samples = np.zeros(2)
        self.squares = np.zeros(2)  # of the whitened innovations
        self.share: Array = np.zeros(2)  # of measurement noise in the innovation's variance, in the last sample
        self.product = 0.0  # of innovation and response
        self.response_square = 0.0

    def add(self, innovation: Innovation, valid: NDArray[np.bool_]) -> None:
        """A sample: its outputs whitened in order, the second given the first."""
        white = np.linalg.solve(innovation.factor, innovation.value)
        response = np.linalg.solve(innovation.factor, innovation.response)
        self.samples[valid] += 1.0
        self.squares[valid] += white**2
        self.share[valid] = (self.output_noise[valid] / innovation.factor.diagonal()) ** 2
        self.product += float(white @ response)
        self.response_square += float(response @ response)

    def end_block(self, period: np.float32) -> bool:
        """After `period` [s]: at the end of a window sets the noise. Returns whether it was far too small."""
        self.elapsed += period
        if self.window <= 0.0 or self.elapsed < self.window:
            return False
        gain = 1.0 + (self.product / self.response_square if self.response_square > 0.0 else 0.0)
        starved = gain > STARVED
        factors = np.array([self._factor(i) for i in range(2)])
        far_too_small = False
        for i in range(2):
            now = self.output_noise[i]
            if starved and self.squares[i] < OUTLIERS**2 * (self.samples[i] + 1.0):
                factors[i] = 1.0
                self.output_noise[i] = np.sqrt(now * min(now, self.output_set[i]))
            elif self.samples[i] >= SAMPLES_LEAST:
                self.output_noise[i] = self._scaled(now, factors[i], self.output_set[i])
                far_too_small |= bool(factors[i] > 1.0 + FAR)
            else:
                factors[i] = 1.0
        if self.response_square > 0.0:
            before = self.process_noise
            factor = gain**2 if starved else gain * float(np.sqrt(factors.prod()))
            self.process_noise = self._scaled(before, factor, self.process_set)
            far_too_small |= self.process_noise > (1.0 + FAR) * before
        self.begin()
        return far_too_small

    def _factor(self, i: int) -> float:
        """By which the noise of output i is wrong. As far as the innovation is noise; outliers always count."""
        factor = float(np.sqrt(self.squares[i] / max(self.samples[i], 1.0)))
        return factor if factor > OUTLIERS else 1.0 + float(self.share[i]) * (factor - 1.0)

    def _scaled(self, now: float, factor: float, setting: float) -> float:
        bounded = min(max(factor, 1.0 / STEP_MOST), STEP_MOST)
        step = bounded if abs(bounded - 1.0) > FAR else 1.0 + SHARE * (bounded - 1.0)
        return min(max(now * step, setting / self.range), setting * self.range)
