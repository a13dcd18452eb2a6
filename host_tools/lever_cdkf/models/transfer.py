"""Transfer functions theta/z_ddot as ratios of polynomials, their response and their modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..numeric.arrays import ComplexArray, FloatArray

BAND = (2.0, 8.0)
"""Where collective bounce lives [Hz]: the mode that answers most in it is the dominant one."""


@dataclass(frozen=True)
class Transfer:
    """theta/z_ddot [rad/(m/s^2)] = numerator(s) / denominator(s), each with a row a time, highest power of s first."""

    numerator: FloatArray
    denominator: FloatArray

    def response(self, frequency: FloatArray) -> ComplexArray:
        """At s = 2 pi i f of the frequencies [Hz]: (times, frequencies)."""
        s = 2j * np.pi * frequency.astype(np.complex128)
        with np.errstate(invalid="ignore"):  # coefficients are NaN where nobody holds the lever
            response: ComplexArray = evaluate(self.numerator, s) / evaluate(self.denominator, s)
        return response

    def dominant_mode(self) -> tuple[FloatArray, FloatArray]:
        """Return natural frequency |p| / 2 pi [Hz] and damping ratio -Re p / |p| [1] of the dominant mode.

        Each is (times,).

        In partial fractions the response is a sum r / (s - p) over the poles p; a mode is a pole with its conjugate.
        Dominant is the one whose own terms have the largest mean square over BAND. Poles must be distinct.
        """
        poles = roots(self.denominator)
        derivative = self.denominator[:, :-1] * np.arange(self.denominator.shape[1] - 1, 0, -1)
        residues = evaluate(self.numerator, poles) / evaluate(derivative, poles)
        s = 2j * np.pi * np.linspace(*BAND, 61)
        terms = residues[..., None] / (s - poles[..., None])
        twins = np.conj(residues)[..., None] / (s - np.conj(poles)[..., None])
        terms += np.where(poles.imag[..., None] != 0.0, twins, 0.0)
        strongest = np.argmax(np.mean(np.abs(terms) ** 2, axis=-1), axis=-1)
        pole = np.take_along_axis(poles, strongest[:, None], axis=1)[:, 0]
        return np.abs(pole) / (2.0 * np.pi), -pole.real / np.abs(pole)


def evaluate(polynomials: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return the polynomials (times, powers) at s, (points,) or (times, points), by Horner's rule: (times, points)."""
    value = np.zeros((len(polynomials), 1), dtype=np.complex128)
    for coefficient in polynomials.T:
        value = value * s + coefficient[:, None]
    return value


def roots(polynomials: FloatArray) -> ComplexArray:
    """Return the roots of each row (times, powers): the eigenvalues of its companion matrix, (times, powers - 1)."""
    monic = polynomials / polynomials[:, :1]
    degree = monic.shape[1] - 1
    companion = np.zeros((len(monic), degree, degree))
    companion[:, 0, :] = -monic[:, 1:]
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    return np.linalg.eigvals(companion).astype(np.complex128)
