"""The loop of lever and helicopter, linearised: is it stable, how far from the limit is it, and what comes beyond.

    L(s) = gearing * P(s) * H(s)        P: z_ddot / delta of the aircraft, H: delta / z_ddot of the pilot on the lever

Both signs are in P and H, so the loop closes by 1 - L(s) = 0 and its critical point is +1. H and P alone are stable; L
then goes round +1 for the first time where it crosses the real axis above 1 (Nyquist), so the gain margin is 1 over the
largest real L(i w), the modulus margin is the least |1 - L(i w)|.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray

from .aircraft import Aircraft

Response = Callable[[ComplexArray], ComplexArray]
"""Of complex frequencies s [rad/s]."""

BAND = (0.5, 20.0)
"""Where crossings are looked for [Hz]; below it is the pilot's own flying."""
_POINTS = 1000
_COARSE = np.geomspace(*BAND, 2000)


@dataclass(frozen=True)
class Margins:
    """Of one loop."""

    gain: float
    """By how much the gearing may grow until the loop is unstable [1]; below 1 it is already, inf if never."""
    frequency: float
    """At which that happens [Hz]."""
    modulus: float
    """min |1 - L| [1]"""
    modulus_frequency: float
    """[Hz]"""


def margins(loop: Response, band: tuple[float, float] = BAND) -> Margins:
    """Return the margins of L in a band [Hz]."""
    frequency = np.geomspace(*band, _POINTS)
    response = loop(_on_axis(frequency))
    crossing, height = _crossings(loop, frequency, response)
    worst = int(np.argmax(height)) if len(height) else -1
    distance = np.abs(1.0 - response)
    nearest = int(np.argmin(distance))
    return Margins(
        gain=float(1.0 / height[worst]) if worst >= 0 else np.inf,
        frequency=float(crossing[worst]) if worst >= 0 else np.nan,
        modulus=float(distance[nearest]),
        modulus_frequency=float(frequency[nearest]),
    )


def critical_gearing(craft: Aircraft, transfer: Transfer) -> FloatArray:
    """Return the gearing at which the loop becomes unstable, at each time of a pilot's transfer function [1].

    It is margins() for many times at once, by a grid alone.
    """
    loop = _response(craft) * transfer.response(_COARSE)
    below, above = loop.imag[:, :-1], loop.imag[:, 1:]
    part = np.where(np.signbit(below) != np.signbit(above), below / (below - above + 1e-300), np.nan)
    height = loop.real[:, :-1] + part * np.diff(loop.real, axis=1)
    highest = np.max(np.where(np.isfinite(height), height, 0.0), axis=1)
    critical: FloatArray = 1.0 / np.maximum(highest, 1e-9)
    return critical


@cache
def _response(craft: Aircraft) -> ComplexArray:
    return craft.response(_on_axis(_COARSE))


def _on_axis(frequency: FloatArray) -> ComplexArray:
    """Return s [rad/s] of frequencies [Hz]."""
    return 2j * np.pi * frequency.astype(np.complex128)


def _crossings(loop: Response, frequency: FloatArray, response: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Where L is real and positive: frequencies [Hz], L there; by secants from the grid."""
    change = np.flatnonzero(np.sign(response.imag[1:]) != np.sign(response.imag[:-1]))
    low, high = frequency[change], frequency[change + 1]
    below = response.imag[change]
    for _ in range(50):
        middle = 0.5 * (low + high)
        at = loop(_on_axis(middle)).imag
        same = np.sign(at) == np.sign(below)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    height = loop(_on_axis(low)).real
    return low[height > 0.0], height[height > 0.0]


def mode(loop: Response, guess: complex) -> complex:
    """Return the root s [rad/s] of 1 - L(s) near `guess`, by Newton's method.

    Re s is the growth rate, Im s the frequency.
    """
    s = guess
    for _ in range(50):
        step = 1e-6 * (1.0 + abs(s))
        ahead, behind, here = loop(np.array((s + step, s - step, s)))
        change = (1.0 - here) / ((ahead - behind) / (2.0 * step))
        s += change
        if abs(change) < 1e-10 * abs(s):
            break
    return complex(s)
