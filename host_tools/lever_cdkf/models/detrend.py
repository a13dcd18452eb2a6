"""Deviation of a signal from its slowly moving level, by a sixth-order Butterworth high-pass.

Outputs and inputs that are detrended alike obey the same linear dynamics; what moves slowly and is unknown, the pilot's
trim and how he moves the lever on purpose above all, drops out.
"""

import math

ORDER = 6
DAMPING = tuple(2.0 * math.cos(math.pi * k / (2 * ORDER)) for k in range(1, ORDER, 2))
"""Of the sections of second order: twice the damping ratios of their poles, which lie evenly on a circle."""


class Detrend:
    """Sections in series, each level/signal = (d w s + w²) / (s² + d w s + w²): no lag on a ramp."""

    def __init__(self, level: float = 0.0) -> None:
        self._levels = [level] + [0.0] * (len(DAMPING) - 1)  # each of what the sections before it leave
        self._slopes = [0.0] * len(DAMPING)  # [unit of the signal / s]

    @property
    def level(self) -> float:
        """The slow level, in the unit of the signal."""
        return sum(self._levels)

    def hold(self) -> None:
        """Hold the level where it is until the next value."""
        self._slopes = [0.0] * len(DAMPING)

    def begin(self, level: float) -> None:
        """As if the signal had always been there."""
        self._levels, self._slopes = [level] + [0.0] * (len(DAMPING) - 1), [0.0] * len(DAMPING)

    def step(self, value: float, corner: float, dt: float) -> float:
        """Return the deviation of `value` from the level before it, `dt` [s] after the last one; corner [Hz]."""
        w = 2.0 * math.pi * corner
        deviation = value
        for i, damping in enumerate(DAMPING):
            deviation -= self._levels[i]
            self._slopes[i] += dt * w**2 * deviation
            self._levels[i] += dt * (self._slopes[i] + damping * w * deviation)
        return deviation
