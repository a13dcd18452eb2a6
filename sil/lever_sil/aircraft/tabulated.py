"""An aircraft that is known by its frequency response alone, as a flight test or another simulation gives it: for the
firmware's table and the linear analysis. It cannot fly (flight.py): a response has no limits of the actuator.

The file is CSV with a row a frequency, rising: frequency [Hz], real and imaginary part of the cabin's vertical
acceleration over the lever's angle [(m/s^2)/rad], with gearing, delays and actuator. Lines that begin with #, and
before the first row of numbers those without any number, are passed over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.arrays import ComplexArray, FloatArray
from lever_cdkf.errors import LeverError
from lever_cdkf.units import number_of


@dataclass(frozen=True)
class Tabulated:
    """z_ddot / delta; linear between the frequencies, as in the firmware."""

    frequency: FloatArray
    """[Hz], rising."""
    values: ComplexArray
    """[m/s^2 per rad]"""

    @classmethod
    def load(cls, path: str | Path) -> Tabulated:
        """From a file. Raises LeverError."""
        try:
            lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeError) as error:
            raise LeverError(f"{path}: {getattr(error, 'strerror', None) or 'not text in UTF-8'}") from None
        rows: list[list[float]] = []
        for number, line in enumerate(lines, 1):
            if line.startswith("#") or not line.strip() or (not rows and not any(map(_is_number, line.split(",")))):
                continue
            cells = [number_of(cell) for cell in line.split(",")]
            if len(cells) != 3 or any(map(math.isnan, cells)):
                raise LeverError(f"{path}: line {number}: must be three numbers: frequency [Hz], real, imaginary")
            if cells[0] <= (rows[-1][0] if rows else 0.0):
                raise LeverError(f"{path}: line {number}: the frequencies must rise, from above 0")
            rows.append(cells)
        if len(rows) < 3:
            raise LeverError(f"{path}: {len(rows)} frequencies; a response has at least 3")
        frequency, real, imaginary = np.array(rows).T
        return cls(frequency, real + 1j * imaginary)

    @property
    def band(self) -> tuple[float, float]:
        """Where it is known [Hz]: the band of stability.margins()."""
        return float(self.frequency[0]), float(self.frequency[-1])

    def response(self, s: ComplexArray) -> ComplexArray:
        """At s on the imaginary axis [rad/s], in the band; beyond it, what it is at its ends."""
        frequency = s.imag / (2.0 * np.pi)
        real, imaginary = (np.interp(frequency, self.frequency, part) for part in (self.values.real, self.values.imag))
        response: ComplexArray = real + 1j * imaginary
        return response

    def at(self, frequency: FloatArray) -> ComplexArray:
        """At other frequencies [Hz], such as the 24 that the firmware takes."""
        return self.response(2j * np.pi * frequency.astype(np.complex128))


def _is_number(cell: str) -> bool:
    """Also one that is not finite, which is no name."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
