"""Measurement and process noise, estimated from windows of innovations.

Measurement noise by covariance matching (A. H. Mohamed, K. P. Schwarz, "Adaptive Kalman filtering for INS/GPS", Journal
of Geodesy 73, 1999); process noise from what is left of past corrections in the innovations (R. K. Mehra, "On the
identification of variances and adaptive Kalman filtering", IEEE TAC 15, 1970).
"""

import math
from collections.abc import Mapping

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .belief import Innovation

SAMPLES_LEAST = 20  # of an output
NEAR = (0.67, 1.5)  # of a factor within, SHARE is done; of one outside, all of it,
STEP = (0.33, 10.0)  # within these
SHARE = 0.2
PROCESS_LEAST = 0.6  # factor of the process noise
STARVED = 1.15  # times the gain, from which on it is the process noise that is too small
CHANCE = 3.0  # standard deviations of the regression, 1 / sqrt(response_square), that this must be
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
        """Start a new window."""
        self.elapsed = np.float32(0.0)
        self.samples = np.zeros(2)
        self.squares = np.zeros(2)  # of the whitened innovations
        self.share: Array = np.zeros(2)  # of measurement noise in the innovation's variance, in the last sample
        self.product = 0.0  # of innovation and response
        self.response_square = 0.0

    def add(self, innovation: Innovation, valid: NDArray[np.bool_]) -> None:
        """Add a sample: its outputs whitened in order, the second given the first."""
        white = np.linalg.solve(innovation.factor, innovation.value)
        response = np.linalg.solve(innovation.factor, innovation.response)
        self.samples[valid] += 1.0
        self.squares[valid] += white**2
        self.share[valid] = (self.output_noise[valid] / innovation.factor.diagonal()) ** 2
        self.product += float(white @ response)
        self.response_square += float(response @ response)

    def end_block(self, period: np.float32, part: float = 1.0) -> bool:
        """Set the noise at the end of that part of a window, `period` [s] on; return whether it was far too small."""
        self.elapsed += period
        if self.window <= 0.0 or self.elapsed < np.float32(self.window) * np.float32(part):
            return False
        gain = 1.0 + (self.product / self.response_square if self.response_square > 0.0 else 0.0)
        starved = gain > STARVED and self.product > CHANCE * math.sqrt(self.response_square)
        factors = [self._correct_output(i, starved) for i in range(2) if self.samples[i] >= SAMPLES_LEAST]
        factor = max(gain**2 if starved else gain * math.sqrt(math.prod(factors)), PROCESS_LEAST)
        before = self.process_noise
        self.process_noise = self._scaled(before, factor, self.process_set)
        far_too_small = max(*factors, self.process_noise / before, 0.0) > NEAR[1]
        self.begin()
        return far_too_small

    def _correct_output(self, i: int, starved: bool) -> float:
        """Set the noise of output i; return the factor by which it was wrong. It counts as far as the innovation is
        noise; outliers always count. With too little gain innovations are too large although the noise is right."""
        excess = math.sqrt(self.squares[i] / self.samples[i])
        factor = excess if excess > OUTLIERS else 1.0 + self.share[i] * (excess - 1.0)
        now, setting = float(self.output_noise[i]), float(self.output_set[i])
        if starved and 1.0 <= excess <= OUTLIERS:
            self.output_noise[i] = math.sqrt(now * min(now, setting))
            return 1.0
        self.output_noise[i] = self._scaled(now, factor, setting)
        return float(factor)

    def _scaled(self, now: float, factor: float, setting: float) -> float:
        bounded = min(max(factor, STEP[0]), STEP[1])
        step = 1.0 + SHARE * (bounded - 1.0) if NEAR[0] <= bounded <= NEAR[1] else bounded
        return min(max(now * step, setting / self.range), setting * self.range)
