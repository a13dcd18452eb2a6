"""The loop of lever and helicopter, linearised: the gearing at which it becomes unstable.

    L(s) = gearing * P(s) * H(s)        P: z_ddot / delta of the aircraft, H: delta / z_ddot of the pilot on the lever

Both signs are in P and H, so the loop closes by 1 - L(s) = 0 and its critical point is +1. H and P alone are stable; L
then goes round +1 for the first time where it crosses the real axis above 1 (Nyquist), so the gain margin is 1 over the
largest real L(i w).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray

from .aircraft import Aircraft

Response = Callable[[ComplexArray], ComplexArray]
"""Of complex frequencies s [rad/s]."""

BAND = (0.5, 20.0)
"""Where crossings are looked for [Hz]; below it is the pilot's own flying."""
_COARSE = np.geomspace(*BAND, 2000)


def critical_gearing(craft: Aircraft, transfer: Transfer) -> FloatArray:
    """Return the gearing at which the loop becomes unstable, at each time of a pilot's transfer function [1].

    Crossings are found on a grid, straight between its points: right to 0.02 dB.
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
    return craft.response(2j * np.pi * _COARSE.astype(np.complex128))
