"""An aircraft that is known by its frequency response alone: for the firmware's table and the linear analysis.

It cannot fly (flight.py): a response has no limits of the actuator and no state.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.host_tools.arrays import ComplexArray, FloatArray
from lever_cdkf.host_tools.firmware.response_file import read_response


@dataclass(frozen=True)
class Tabulated:
    """z_ddot / delta with gearing, delays and actuator; linear between the frequencies, as in the firmware."""

    frequency: FloatArray
    """[Hz], rising."""
    values: ComplexArray
    """[m/s^2 per rad]"""

    @classmethod
    def load(cls, path: str | Path) -> Tabulated:
        """From a file of host_tools/firmware/response_file.py. Raises LeverError."""
        table = read_response(path)
        return cls(np.array(table.frequency), np.array(table.response))

    @property
    def band(self) -> tuple[float, float]:
        """Where it is known [Hz]: the band of stability.margins()."""
        return float(self.frequency[0]), float(self.frequency[-1])

    def response(self, s: ComplexArray) -> ComplexArray:
        """At s on the imaginary axis [rad/s]; outside the table its ends."""
        frequency = s.imag / (2.0 * np.pi)
        real, imaginary = (np.interp(frequency, self.frequency, part) for part in (self.values.real, self.values.imag))
        response: ComplexArray = real + 1j * imaginary
        return response

    def at(self, frequency: FloatArray) -> ComplexArray:
        """At other frequencies [Hz], such as the 24 that the firmware takes."""
        return self.response(2j * np.pi * frequency.astype(np.complex128))
