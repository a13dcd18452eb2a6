"""Transfer functions against scipy: response, poles, and which mode is the dominant one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.models.transfer import Transfer, roots
from scipy import signal


def mode(frequency: float, ratio: float) -> np.ndarray:
    """s^2 + 2 zeta omega s + omega^2."""
    omega = 2.0 * math.pi * frequency
    return np.array([1.0, 2.0 * ratio * omega, omega**2])


def parallel(*parts: tuple[float, float, float]) -> Transfer:
    """Return the sum of gain / mode(frequency, ratio) over (gain, frequency, ratio)."""
    denominator = np.array([1.0])
    for _, frequency, ratio in parts:
        denominator = np.polymul(denominator, mode(frequency, ratio))
    numerator = np.zeros(1)
    for gain, frequency, ratio in parts:
        numerator = np.polyadd(numerator, gain * np.polydiv(denominator, mode(frequency, ratio))[0])
    return Transfer(numerator[None], denominator[None])


def test_response_is_that_of_freqs() -> None:
    random = np.random.default_rng(1)
    numerator, denominator = random.uniform(1.0, 2.0, (4, 3)), random.uniform(1.0, 2.0, (4, 5))
    frequency = np.linspace(0.1, 3.0, 7)
    response = Transfer(numerator, denominator).response(frequency)
    for row, (above, below) in enumerate(zip(numerator, denominator, strict=True)):
        assert response[row] == pytest.approx(signal.freqs(above, below, 2.0 * math.pi * frequency)[1])


def test_roots_are_those_of_numpy_row_by_row() -> None:
    polynomials = np.random.default_rng(2).standard_normal((20, 5))
    for found, polynomial in zip(roots(polynomials), polynomials, strict=True):
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.roots(polynomial)), atol=1e-9)


@pytest.mark.parametrize(("gains", "expected"), [((1.0, 0.2), (3.0, 0.3)), ((0.1, 2.0), (5.0, 0.4))])
def test_the_mode_that_answers_most_between_2_and_8_hz_is_dominant(
    gains: tuple[float, float], expected: tuple[float, float]
) -> None:
    transfer = parallel((gains[0], 3.0, 0.3), (gains[1], 5.0, 0.4))
    frequency, ratio = transfer.dominant_mode()
    assert (frequency[0], ratio[0]) == pytest.approx(expected)


def test_a_strong_mode_outside_the_band_is_not_dominant() -> None:
    frequency, _ = parallel((1.0, 4.0, 0.3), (20.0, 40.0, 0.1)).dominant_mode()
    assert frequency[0] == pytest.approx(4.0)


def test_shares_are_those_of_the_partial_fractions() -> None:
    """With one real pole more: scipy.signal.residue, and the mean square of each mode's terms by itself."""
    transfer = parallel((1.0, 3.0, 0.3), (1.0, 5.0, 0.4))
    numerator = np.polyadd(np.polymul(transfer.numerator[0], [1.0, 9.0]), 2.0 * transfer.denominator[0])
    denominator = np.polymul(transfer.denominator[0], [1.0, 9.0])
    residues, poles, _ = signal.residue(numerator, denominator)
    s = 2j * math.pi * np.linspace(2.0, 8.0, 1000)
    strength = {}
    for key in {(round(abs(pole), 6), round(pole.real, 6)) for pole in poles}:
        mine = [i for i, pole in enumerate(poles) if (round(abs(pole), 6), round(pole.real, 6)) == key]
        strength[key] = np.mean(np.abs(sum(residues[i] / (s - poles[i]) for i in mine)) ** 2)
    size, real = max(strength, key=lambda key: strength[key])
    frequency, ratio = Transfer(numerator[None], denominator[None]).dominant_mode()
    assert frequency[0] == pytest.approx(size / (2.0 * math.pi), rel=1e-5)
    assert ratio[0] == pytest.approx(-real / size, rel=1e-5)
