"""Whether one signal is the slope of another, and how signals are compared at all: as means over the same 20 ms."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .arrays import FloatArray

STEP = 0.02
"""[s] of a mean."""
_LONGEST = 60.0  # [s] that are compared
_ALIKE = 0.8  # correlation from which on a ratio says something
_IN_DEGREES = {"theta_dot": (40.0, 80.0), "theta": (0.0125, 0.025)}  # of derivative_ratio(), where the other is in rad


class Signal(Protocol):
    """Values at times [s], which rise."""

    @property
    def time(self) -> FloatArray:
        """[s], rising."""

    @property
    def values(self) -> FloatArray:
        """One for each time."""


def in_degrees(theta: Signal, theta_dot: Signal) -> tuple[str, str] | None:
    """Return which of the two looks like degrees where the other is in radians, and why."""
    ratio = abs(derivative_ratio(theta, theta_dot))
    for name, (low, high) in _IN_DEGREES.items():
        if low < ratio < high:
            return name, f"theta_dot is {ratio:.3g} times the slope of theta: {name} looks like degrees"
    return None


def interval_means(one: Signal, other: Signal) -> tuple[FloatArray, FloatArray]:
    """Their means over the same stretches of STEP, of at most a minute."""
    if not len(one.time) or not len(other.time):
        return np.zeros(0), np.zeros(0)
    first = max(one.time[0], other.time[0])
    edges = np.arange(first, min(one.time[-1], other.time[-1], first + _LONGEST), STEP)
    return _means(one, edges), _means(other, edges)


def derivative_correlation(angle: Signal, rate: Signal) -> float:
    """Return correlation of the slope of an angle with a rate; 0 where there is too little of both."""
    return _likeness(*_slope_and_rate(angle, rate))


def derivative_ratio(angle: Signal, rate: Signal) -> float:
    """Return a rate as a multiple of the slope of the angle, negative where their signs differ.

    It is 0 where they are not alike.
    """
    slope, value = _slope_and_rate(angle, rate)
    likeness = _likeness(slope, value)
    return float(np.sign(likeness) * np.std(value) / np.std(slope)) if abs(likeness) > _ALIKE else 0.0


def _likeness(slope: FloatArray, rate: FloatArray) -> float:
    return float(np.corrcoef(slope, rate)[0, 1]) if len(slope) else 0.0


def _slope_and_rate(angle: Signal, rate: Signal) -> tuple[FloatArray, FloatArray]:
    """Return both at the same times, as far as both are known; empty where that is too little."""
    angles, rates = interval_means(angle, rate)
    slope, value = (angles[2:] - angles[:-2]) / (2.0 * STEP), rates[1:-1]
    both = np.isfinite(slope) & np.isfinite(value)
    slope, value = slope[both], value[both]
    enough = len(slope) >= 40 and np.std(slope) > 0.0 and np.std(value) > 0.0
    return (slope, value) if enough else (np.zeros(0), np.zeros(0))


def _means(signal: Signal, edges: FloatArray) -> FloatArray:
    """Return means between the edges [s]; NaN where there is no value."""
    if len(edges) < 2:
        return np.zeros(0)
    valid = np.isfinite(signal.values)
    bins = np.digitize(signal.time[valid], edges) - 1
    inside = (bins >= 0) & (bins < len(edges) - 1)
    sums = np.bincount(bins[inside], signal.values[valid][inside], len(edges) - 1)
    counts = np.bincount(bins[inside], minlength=len(edges) - 1)
    means: FloatArray = sums / np.where(counts > 0, counts, np.nan)
    return means
