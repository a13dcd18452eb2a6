"""A state space from a frequency response, by vector fitting.

The method is that of Gustavsen and Semlyen: Rational approximation of frequency domain responses by vector fitting,
IEEE Trans. Power Delivery 14, 1999.

    f(s) = d + sum r_k / (s - p_k)

Poles are relocated to the zeros of sigma(s) = 1 + sum q_k / (s - p_k), where sigma f and sigma are fitted with the same
poles by least squares; those that come out unstable are mirrored. Errors are relative to |f|, so that a notch counts
as much as a peak. Coefficients are real: a complex pair of poles has the basis 1/(s-p) + 1/(s-p*), i/(s-p) - i/(s-p*).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray

from .state_space import StateSpace

MOST_PAIRS = 8
GOOD = 0.005
"""Relative error [1] at which no further poles are tried."""
_ROUNDS = 12
_FOLDS = 5  # of cross-validation
_SIMPLER = 2.0  # times the least median error that a fit with fewer pairs may have
_STANDS_OUT = 5.0  # median errors: Gaussian noise gives as much to one value in 10^7


@dataclass(frozen=True)
class Fit:
    """A state space of one input and one output, in real blocks."""

    system: StateSpace
    error: FloatArray
    """Relative to |f|, at the frequencies given [1]."""


def fit(s: ComplexArray, values: ComplexArray, most_pairs: int = MOST_PAIRS, good: float = GOOD) -> Fit:
    """Return the fit with the fewest pairs of poles that is good at every frequency, or the best.

    s [rad/s] is on the imaginary axis.
    """
    found: Fit | None = None
    for pairs in range(1, _most_pairs(s, most_pairs) + 1):
        tried = _with_pairs(s, values, pairs)
        if found is None or tried.error.max() < found.error.max():
            found = tried
        if found.error.max() <= good:
            break
    assert found is not None
    return found


def outlier(s: ComplexArray, values: ComplexArray, least: float) -> tuple[int, float] | None:
    """Return the place of the value that is furthest from a fit to others, and how far, relative to that fit [1].

    The residual of the fit to all does not show a wrong value: a pair of poles of its own goes through it. Of the fits
    to others it is the simplest whose median error is near the least: more pairs would follow the noise. None: no
    value is off by `least` and stands out from the scatter; the ends are not judged.
    """
    tried = [_left_out(s, values, pairs) for pairs in range(1, _most_pairs(s) + 1)]
    good = _SIMPLER * min(float(np.median(each)) for each in tried)
    off = next(each for each in tried if np.median(each) <= good)
    place = int(off.argmax())
    return (place, float(off[place])) if off[place] > max(least, _STANDS_OUT * float(np.median(off))) else None


def _left_out(s: ComplexArray, values: ComplexArray, pairs: int) -> FloatArray:
    """Return how far each value is from a fit to four fifths of the others; 0 at both ends."""
    error, inner = np.zeros(len(s)), np.arange(1, len(s) - 1)
    for first in range(min(_FOLDS, len(inner))):
        left_out = inner[first::_FOLDS]
        system = _with_pairs(np.delete(s, left_out), np.delete(values, left_out), pairs).system
        error[left_out] = np.abs(values[left_out] / system.response(s[left_out], 0, 0) - 1.0)
    return error


def _most_pairs(s: ComplexArray, most: int = MOST_PAIRS) -> int:
    """Return how many pairs of poles the points can carry."""
    return max(1, min(most, (len(s) - 1) // 2))


def _with_pairs(s: ComplexArray, values: ComplexArray, pairs: int) -> Fit:
    low, high = np.abs(s[[0, -1]])
    centre = np.geomspace(low, high, pairs)
    a, b = _blocks(centre * (-0.01 + 1j))
    weight = 1.0 / np.abs(values)
    for _ in range(_ROUNDS):
        basis = _basis(a, b, s)
        ones = np.ones((len(s), 1))
        unknown = np.hstack((basis, ones, -values[:, None] * basis)) * weight[:, None]
        solution = _least_squares(unknown.astype(np.complex128), values * weight)
        zeros = np.linalg.eigvals(a - np.outer(b, solution[len(a) + 1 :])).astype(np.complex128)
        a, b = _blocks(_stable_pairs(zeros))
    basis = _basis(a, b, s)
    known = (np.hstack((basis, np.ones((len(s), 1)))) * weight[:, None]).astype(np.complex128)
    solution = _least_squares(known, values * weight)
    error = np.abs(known @ solution - values * weight)
    return Fit(StateSpace(a, b[:, None], solution[None, :-1], solution[None, -1:]), error)


def _least_squares(matrix: ComplexArray, right: ComplexArray) -> FloatArray:
    rows = np.vstack((matrix.real, matrix.imag))
    scale = np.linalg.norm(rows, axis=0)
    solution, *_ = np.linalg.lstsq(rows / scale, np.append(right.real, right.imag), rcond=None)
    result: FloatArray = solution / scale
    return result


def _stable_pairs(poles: ComplexArray) -> ComplexArray:
    """Return one of each complex pair, and real poles by themselves, mirrored into the left half-plane."""
    stable = -np.abs(poles.real) - 1e-9 * np.abs(poles) + 1j * poles.imag
    return stable[poles.imag >= 0.0]


def _blocks(poles: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return a and b in real form of the poles, of which complex ones stand for their pair."""
    size = int(np.sum(np.where(poles.imag > 0.0, 2, 1)))
    a, b, at = np.zeros((size, size)), np.zeros(size), 0
    for pole in poles:
        if pole.imag > 0.0:
            a[at : at + 2, at : at + 2] = (pole.real, pole.imag), (-pole.imag, pole.real)
            b[at] = 2.0
            at += 2
        else:
            a[at, at], b[at] = pole.real, 1.0
            at += 1
    return a, b


def _basis(a: FloatArray, b: FloatArray, s: ComplexArray) -> ComplexArray:
    """Return (s - A)^-1 b at each s: (points, states)."""
    right = np.broadcast_to(b[:, None], (len(s), len(a), 1)).astype(np.complex128)
    basis: ComplexArray = np.linalg.solve(s[:, None, None] * np.eye(len(a)) - a, right)[:, :, 0].astype(np.complex128)
    return basis
