"""Deviation of a signal from its slowly moving level, by a second-order Butterworth high-pass.

Outputs and inputs that are detrended alike obey the same linear dynamics; what moves slowly and is unknown, the pilot's
trim above all, drops out.
"""

import math


class Detrend:
    """level/signal = (√2 w s + w²) / (s² + √2 w s + w²): no lag on a ramp."""

    def __init__(self, level: float = 0.0) -> None:
        self.level = level
        self.slope = 0.0  # [unit of the signal / s]

    def step(self, value: float, corner: float, dt: float) -> float:
        """The deviation of `value` from the level before it, `dt` [s] after the last one; corner [Hz]."""
        w = 2.0 * math.pi * corner
        deviation = value - self.level
        self.slope += dt * w**2 * deviation
        self.level += dt * (self.slope + math.sqrt(2.0) * w * deviation)
        return deviation
