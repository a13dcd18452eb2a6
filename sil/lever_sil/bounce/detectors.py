"""What others watch for oscillations with: the lever's angle and the cabin's acceleration alone, without a model.

Both give a level that rises with an oscillation; above a threshold they would raise an alarm. The thresholds are the
lowest that raise none in the ten hours of stable flight of conditions.py: `lever bounce --only false_alarms`.

`rover` is the logic of the Real-time Oscillation VERifier (Mitchell, Arencibia, Munoz: Real-time detection of
pilot-induced oscillations, AIAA 2004-4700): half cycles of both signals in a band, an oscillation where frequency,
both amplitudes and the phase between them are those of the coupling, in some half cycles on end. The phase is taken
from the aircraft's response, which the original does not have.

`spectrum` is a recursive Fourier transform with exponential forgetting (Morelli: Real-time parameter estimation in the
frequency domain, J. Guidance 23, 2000): the geometric mean of both amplitudes at the frequency where it is highest.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

RATE = 50
"""Of what they watch [Hz]."""
LEVER_UNIT = math.radians(0.5)
"""Of the lever's angle, where the acceleration counts in m/s^2: about what one makes of the other at the coupling."""

THRESHOLDS = {"uh60_like": (0.947, 0.833), "puma_like": (0.949, 0.826), "bo105_like": (0.983, 0.920)}
"""Of `rover` and `spectrum` with each of the aircraft [m/s^2]."""

Response = Callable[[complex], complex]
"""z_ddot / delta of the aircraft [m/s^2 per rad] at s [rad/s]."""


@dataclass(frozen=True)
class Watched:
    """Signals at RATE."""

    theta: FloatArray
    """[rad]"""
    z_ddot: FloatArray
    """[m/s^2]"""

    @classmethod
    def of(cls, theta: FloatArray, z_ddot: FloatArray, period: float) -> Watched:
        """Return means over a sample period of the detectors, of signals whose samples are `period` [s] apart."""
        step = round(1.0 / (RATE * period))
        count = len(theta) // step * step
        return cls(*(signal[:count].reshape(-1, step).mean(axis=1) for signal in (theta - theta[0], z_ddot)))


# --- rover -----------------------------------------------------------------------------------------------------------

ROVER_BAND = (1.5, 8.0)
"""[Hz]"""
PHASE = math.radians(60.0)
"""By which the phase may differ from that of a sustained oscillation."""
HALF_CYCLES = 5
"""Of 2, 3 and 5 that with the earliest alarm, as a median."""


def rover(watched: Watched, response: Response) -> FloatArray:
    """Return the level at each sample."""
    cabin, lever = (_band_passed(signal) for signal in (watched.z_ddot, watched.theta))
    peaks, own = _extrema(cabin), _extrema(lever)
    level, last = np.zeros(len(cabin)), [0.0] * HALF_CYCLES
    for before, now in pairwise(peaks):
        last = [*last[1:], _half_cycle(cabin, lever, own, before, now, response)]
        level[now:] = min(last)
    return level


def _half_cycle(
    cabin: FloatArray, lever: FloatArray, own: list[int], before: int, now: int, response: Response
) -> float:
    """Return the amplitude between two extrema of the cabin's acceleration.

    It is 0 if frequency or phase are not the coupling's.
    """
    frequency = RATE / (2.0 * (now - before))
    index = int(np.searchsorted(own, now, side="right"))
    if not ROVER_BAND[0] <= frequency <= ROVER_BAND[1] or index < 2:
        return 0.0
    same = next((at for at in own[index - 1 :: -1] if (lever[at] > 0.0) == (cabin[now] > 0.0)), None)
    if same is None:
        return 0.0
    ahead = 2.0 * math.pi * frequency * (now - same) / RATE
    expected = -cmath.phase(response(2j * math.pi * frequency))
    if abs(cmath.phase(cmath.exp(1j * (ahead - expected)))) > PHASE:
        return 0.0
    of_lever = abs(float(lever[own[index - 1]] - lever[own[index - 2]])) / LEVER_UNIT
    return 0.5 * min(abs(float(cabin[now] - cabin[before])), of_lever)


def _band_passed(signal: FloatArray) -> FloatArray:
    """By a causal filter: a high-pass and a low-pass of second order (Butterworth)."""
    low, high = (math.tan(math.pi * corner / RATE) for corner in ROVER_BAND)
    passed = _filtered(signal, (1.0, -2.0, 1.0), low)
    return _filtered(passed, (high * high, 2.0 * high * high, high * high), high)


def _filtered(signal: FloatArray, numerator: tuple[float, float, float], warped: float) -> FloatArray:
    """Return a second-order Butterworth section by the bilinear transform; `warped` is the tangent of its corner."""
    square, root = warped * warped, math.sqrt(2.0) * warped
    scale = 1.0 + root + square
    b0, b1, b2 = (each / scale for each in numerator)
    a1, a2 = 2.0 * (square - 1.0) / scale, (1.0 - root + square) / scale
    passed, first, second = [], 0.0, 0.0
    for value in signal.tolist():
        now = b0 * value + first
        first = b1 * value - a1 * now + second
        second = b2 * value - a2 * now
        passed.append(now)
    return np.array(passed)


def _extrema(signal: FloatArray) -> list[int]:
    """Where it turns: in turn the highest and the lowest between two changes of its sign."""
    ends = np.flatnonzero(np.diff(np.signbit(signal))) + 1
    return [int(a + np.argmax(np.abs(signal[a:b]))) for a, b in pairwise(ends)]


# --- spectrum --------------------------------------------------------------------------------------------------------

SPECTRUM = np.arange(2.0, 8.01, 0.25)
"""[Hz]"""
MEMORY = 2.0
"""Time constant with which it forgets [s]: of 0.5, 1 and 2 that with the earliest alarm, as a median."""


def spectrum(watched: Watched) -> FloatArray:
    """Return the level at each sample."""
    forgets = math.exp(-1.0 / (MEMORY * RATE))
    turn = np.exp(-2j * np.pi * SPECTRUM / RATE)
    signals = np.stack((watched.z_ddot, watched.theta / LEVER_UNIT), axis=1)
    transform, phase = np.zeros((2, len(SPECTRUM)), np.complex128), np.ones(len(SPECTRUM), np.complex128)
    level, scale = np.empty(len(signals)), 2.0 * (1.0 - forgets)
    for sample, values in enumerate(signals):
        phase = phase * turn
        transform = forgets * transform + values[:, None] * phase
        level[sample] = scale * math.sqrt(float(np.max(np.abs(transform[0] * transform[1]))))
    return level
