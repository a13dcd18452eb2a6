"""Biodynamic feedthrough θ/z̈ as the estimator sends it, one frequency after the other."""

from __future__ import annotations

import numpy as np

from ..firmware.estimator import FEEDTHROUGH_FREQUENCIES
from ..numeric.arrays import FloatArray
from .in_turn import InTurn

# column of the trace, its message and field
FEEDTHROUGH = (
    ("feedthrough_frequency_Hz", "FEEDTHROUGH", "frequency"),
    ("feedthrough_real_rad_s2_m", "FEEDTHROUGH", "real"),
    ("feedthrough_imaginary_rad_s2_m", "FEEDTHROUGH", "imaginary"),
    ("feedthrough_gain_sigma", "FEEDTHROUGH", "gain_sigma"),
    ("feedthrough_phase_sigma_rad", "FEEDTHROUGH", "phase_sigma"),
)
FREQUENCIES: FloatArray = np.array(FEEDTHROUGH_FREQUENCIES, dtype=np.float64)
"""[Hz]"""


class Feedthrough(InTurn):
    """Keeps the feedthrough at each frequency, of samples as they come."""

    def __init__(self) -> None:
        super().__init__([column for column, _, _ in FEEDTHROUGH], FREQUENCIES)

    def at(self, time: FloatArray) -> dict[str, FloatArray]:
        """Return the response (complex) [rad/(m/s²)], gain_sigma [1] and phase_sigma [rad], each (times, FREQUENCIES).

        They are as last sent before each time [s]; NaN before the first, and where it was not available.
        """
        latest = self.latest(time)
        return {
            "response": latest[..., 0] + 1j * latest[..., 1],
            "gain_sigma": latest[..., 2],
            "phase_sigma": latest[..., 3],
        }
