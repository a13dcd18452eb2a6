"""The loop of a pilot on his lever and a helicopter, linearised, with its margins and modes: aircraft/stability.py.

The gain margin is 1 over the largest real L(i w), the modulus margin is the least |1 - L(i w)|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.aircraft.stability import BAND, Response
from lever_sil.aircraft.tabulated import Tabulated

_POINTS = 1000
_HALVINGS = 16
"""A step of the grid is 0.2 % of its frequency; halved so often, it is 3e-8 of it."""


def loop_of(coupled: Coupled | Tabulated, transfer: Transfer, row: int) -> Response:
    numerator, denominator = transfer.numerator[row], transfer.denominator[row]

    def loop(s: ComplexArray) -> ComplexArray:
        response: ComplexArray = coupled.response(s) * np.polyval(numerator, s) / np.polyval(denominator, s)
        return response

    return loop


def on_axis(frequency: FloatArray) -> ComplexArray:
    """Return s [rad/s] of frequencies [Hz]."""
    return 2j * np.pi * frequency.astype(np.complex128)


def decibels(ratio: float) -> float:
    return float(20.0 * np.log10(ratio))


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
    response = loop(on_axis(frequency))
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


def _crossings(loop: Response, frequency: FloatArray, response: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Where L is real and positive: frequencies [Hz], L there; by halving steps of the grid."""
    change = np.flatnonzero(np.sign(response.imag[1:]) != np.sign(response.imag[:-1]))
    low, high = frequency[change], frequency[change + 1]
    below = response.imag[change]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        at = loop(on_axis(middle)).imag
        same = np.sign(at) == np.sign(below)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    height = loop(on_axis(low)).real
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
