"""Biodynamic feedthrough θ/z̈ as the estimator sends it, from the columns of a trace: one frequency after the other,
put side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..firmware.estimator import FEEDTHROUGH_FREQUENCIES
from ..numeric.arrays import FloatArray

# column of the trace, its message and field
FEEDTHROUGH = (
    ("feedthrough_frequency_Hz", "FEEDTHROUGH", "frequency"),
    ("feedthrough_real_rad_s2_m", "FEEDTHROUGH", "real"),
    ("feedthrough_imaginary_rad_s2_m", "FEEDTHROUGH", "imaginary"),
    ("feedthrough_gain_sigma", "FEEDTHROUGH", "gain_sigma"),
    ("feedthrough_phase_sigma_rad", "FEEDTHROUGH", "phase_sigma"),
)
COLUMNS = ("time_s", *(column for column, _, _ in FEEDTHROUGH))
FREQUENCIES: FloatArray = np.array(FEEDTHROUGH_FREQUENCIES, dtype=np.float64)
"""[Hz]"""
_THINNED = 0.5  # [s]


class Feedthrough:
    """Kept of samples as they come: each frequency twice a second, at most."""

    def __init__(self) -> None:
        self._parts: list[FloatArray] = []

    def add(self, trace: Mapping[str, NDArray[Any]]) -> None:
        """Further samples; a trace without these columns leaves nothing."""
        if not set(COLUMNS) <= trace.keys():
            return
        rows = np.column_stack([np.asarray(trace[name], dtype=np.float64) for name in COLUMNS])
        rows = rows[np.isin(rows[:, 1], FREQUENCIES)][::-1]  # the last of each is kept
        slot = np.floor(rows[:, 0] / _THINNED) * 16.0 + rows[:, 1]
        self._parts.append(rows[np.unique(slot, return_index=True)[1]])

    def at(self, time: FloatArray) -> dict[str, FloatArray]:
        """response (complex) [rad/(m/s²)], gain_sigma [1] and phase_sigma [rad], each (times, FREQUENCIES), as last
        sent before each time [s]; NaN before the first, and where it was not available."""
        rows = np.concatenate([np.full((1, len(COLUMNS)), np.nan), *self._parts])
        latest = np.full((len(time), len(FREQUENCIES), len(COLUMNS)), np.nan)
        for index, frequency in enumerate(FREQUENCIES):
            own = rows[rows[:, 1] == frequency]
            last = np.searchsorted(own[:, 0], time, side="right") - 1
            latest[last >= 0, index] = own[last[last >= 0]]
        return {
            "response": latest[..., 2] + 1j * latest[..., 3],
            "gain_sigma": latest[..., 4],
            "phase_sigma": latest[..., 5],
        }
