"""An aircraft that is known by its frequency response alone, as a flight test or another simulation gives it.

It serves for the firmware's table and the linear analysis, and by a state space that is fitted to it
(vector_fitting.py) to fly.

The file is CSV with a row a frequency, rising: frequency [Hz], real and imaginary part of the vertical acceleration at
the pilot's seat over the lever's angle [(m/s^2)/rad], with gearing, delays and actuator. Where the accelerometer is not
at the seat, two columns more: real and imaginary part of the acceleration at the seat over that at the accelerometer
[1]. Lines that begin with #, and before the first row of numbers those without any number, are passed over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray
from lever_cdkf.text.units import number_of

from .state_space import StateSpace, is_state_space
from .vector_fitting import fit


@dataclass(frozen=True)
class Tabulated:
    """z_ddot / delta; linear between the frequencies, as in the firmware."""

    frequency: FloatArray
    """[Hz], rising."""
    values: ComplexArray
    """[m/s^2 per rad]"""
    seat: ComplexArray | None = None
    """z_ddot at the seat over that at the accelerometer [1]; None: it is there."""

    @classmethod
    def load(cls, path: str | Path) -> Tabulated:
        """From a file. Raise LeverError."""
        try:
            lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeError) as error:
            raise LeverError(f"{path}: {getattr(error, 'strerror', None) or 'not text in UTF-8'}") from None
        rows: list[list[float]] = []
        for number, line in enumerate(lines, 1):
            if line.startswith("#") or not line.strip() or (not rows and not any(map(_is_number, line.split(",")))):
                continue
            cells = [number_of(cell) for cell in line.split(",")]
            if len(cells) not in (3, 5) or any(map(math.isnan, cells)) or len(cells) != len((rows or [cells])[0]):
                raise LeverError(
                    f"{path}: line {number}: must be three numbers: frequency [Hz], real, imaginary; or in all lines "
                    "five, with real and imaginary part of seat over accelerometer"
                )
            if cells[0] <= (rows[-1][0] if rows else 0.0):
                raise LeverError(f"{path}: line {number}: the frequencies must rise, from above 0")
            rows.append(cells)
        if len(rows) < 3:
            raise LeverError(f"{path}: {len(rows)} frequencies; a response has at least 3")
        columns = np.array(rows).T
        seat = columns[3] + 1j * columns[4] if len(columns) == 5 else None
        if not np.all(np.abs(columns[1:3]).sum(axis=0)) or (seat is not None and not np.all(seat)):
            raise LeverError(f"{path}: is zero at a frequency")
        return cls(columns[0], columns[1] + 1j * columns[2], seat)

    def fitted(self, gearing: float, delay: float) -> tuple[StateSpace, float]:
        """Return a state space of pitch and gust to seat and accelerometer, and its largest relative error [1].

        A gust accelerates both; gearing [1] and delay [s], which are in the table, are left out.
        """
        s = 2j * np.pi * self.frequency.astype(np.complex128)
        values = self.values * np.exp(s * delay) / gearing
        fits = tuple(fit(s, each) for each in ((values,) if self.seat is None else (values, values / self.seat)))
        size = sum(len(each.system.a) for each in fits)
        a, b, c, d = np.zeros((size, size)), np.zeros((size, 2)), np.zeros((2, size)), np.ones((2, 2))
        at = 0
        for place, each in enumerate(fits):  # what is at the seat is at the accelerometer, unless it has its own
            system, block = each.system, slice(at, at + len(each.system.a))
            a[block, block], b[block, :1], d[place:, :1] = system.a, system.b, system.d
            c[place:, :at], c[place:, block] = 0.0, system.c
            at = block.stop
        return StateSpace(a, b, c, d), max(float(each.error.max()) for each in fits)

    @property
    def band(self) -> tuple[float, float]:
        """Where it is known [Hz]."""
        return float(self.frequency[0]), float(self.frequency[-1])

    def response(self, s: ComplexArray) -> ComplexArray:
        """At s on the imaginary axis [rad/s], in the band; beyond it, what it is at its ends."""
        frequency = s.imag / (2.0 * np.pi)
        real, imaginary = (np.interp(frequency, self.frequency, part) for part in (self.values.real, self.values.imag))
        response: ComplexArray = real + 1j * imaginary
        return response


def is_response(path: Path) -> bool:
    """Return whether a file is to hold a frequency response, not a state space."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return path.suffix.lower() == ".csv"
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return not is_state_space(first)


def _is_number(cell: str) -> bool:
    """Also one that is not finite, which is no name."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
