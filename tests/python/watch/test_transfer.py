"""θ/z̈ over frequency against the roots of the model's equations, and its band against what was sent."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator
from lever_cdkf.report.bode import SIGMAS
from lever_cdkf.watch.picture import Feedthrough
from lever_cdkf.watch.transfer import FREQUENCIES, Geometry

DEGREES = 180.0 / math.pi
SENT = [Feedthrough(f, complex(math.nan), 0.01 * f, 0.002 * f) for f in range(2, 9)]
"""With standard deviations in proportion to the frequency."""


def lever_response(frequency: float, m_p: float, c_p: float, k_p: float, trim: float) -> complex:
    """firmware/THEORY.md linearised by hand, with the working values of the lever [rad/(m/s²)]."""
    length, mass, place, inertia, c_l, k_l, g = 0.45, 1.2, 0.5, 0.020, 0.5, 5.0, 9.80665
    moment = place * mass + m_p
    s = 2j * math.pi * frequency
    total = length**2 * (place**2 * mass + m_p) + inertia
    damping = c_p * length**2 * math.cos(trim) ** 2 + c_l
    # d/dθ of g l μ cosθ + l² k_p (sinθ - sinθ̂) cosθ + k_l (θ - θ̄), where θ̄ is the trim and sinθ̂ = sinθ₀ + g μ/(k_p l)
    sine_rest = math.sin(trim) + g * moment / (k_p * length)
    spring = -g * length * moment * math.sin(trim) + k_l
    spring += length**2 * k_p * (math.cos(trim) ** 2 - (math.sin(trim) - sine_rest) * math.sin(trim))
    return -length * moment * math.cos(trim) / (total * s**2 + damping * s + spring)


def physical_response(frequency: float, m: float, c: float, k: float) -> complex:
    s = 2j * math.pi * frequency
    return m / (m * s**2 + c * s + k)


def black_box_response(frequency: float, a21: float, a22: float, b21: float) -> complex:
    s = 2j * math.pi * frequency
    return b21 / (s**2 - a22 * s - a21)


def hand_response(frequency: float, k_hand: float, c_hand: float, c_space: float, trim: float) -> complex:
    """Mayo's H - 1, over s² for acceleration and l cos(trim) for the angle."""
    s = 2j * math.pi * frequency
    hand = ((c_hand - c_space) * s + k_hand) / (s**2 + c_hand * s + k_hand)
    return (hand - 1.0) / s**2 / (0.45 * math.cos(trim))


CASES = [
    ("lever", (2.5, 42.0, 1500.0), [lever_response(f, 2.5, 42.0, 1500.0, 0.35) for f in FREQUENCIES]),
    ("linear_physical", (2.7, 42.0, 1500.0), [physical_response(f, 2.7, 42.0, 1500.0) for f in FREQUENCIES]),
    ("linear_black_box", (-500.0, -14.0, -2.0), [black_box_response(f, -500.0, -14.0, -2.0) for f in FREQUENCIES]),
    ("linear_black_box", (-500.0, -14.0, 2.0), [black_box_response(f, -500.0, -14.0, 2.0) for f in FREQUENCIES]),
    ("hand", (452.3, 13.7, 8.51), [hand_response(f, 452.3, 13.7, 8.51, 0.35) for f in FREQUENCIES]),
]


@pytest.mark.parametrize(("model", "parameters", "expected"), CASES)
def test_response(model: str, parameters: tuple[float, float, float], expected: list[complex]) -> None:
    response = Geometry(Config(model=model)).response(model, parameters, 0.35, SENT)
    assert response is not None
    values = np.array(expected)
    np.testing.assert_allclose(response.magnitude, DEGREES * np.abs(values), rtol=1e-6)
    phasor = np.exp(1j * np.radians(response.phase))
    np.testing.assert_allclose(phasor, values / np.abs(values), atol=1e-6)
    assert np.all(np.abs(np.diff(response.phase)) < 20.0)  # goes on, instead of jumping by 360


def test_a_trunk_on_its_seat_is_part_of_it() -> None:
    """Against the C library at the first guess, about an angle of 0."""
    config = Config(settings={"seat_frequency": 4.5})
    response = Geometry(config).response("lever", (2.5, 42.0, 1500.0), 0.0, SENT)
    assert response is not None
    estimator = Estimator(config)
    expected = np.array([estimator.feedthrough(f).response for f in FREQUENCIES])
    np.testing.assert_allclose(response.magnitude, DEGREES * np.abs(expected), rtol=1e-4)
    np.testing.assert_allclose(np.exp(1j * np.radians(response.phase)), expected / np.abs(expected), atol=1e-4)


def test_the_band_is_what_was_sent_and_none_beyond() -> None:
    response = Geometry(Config()).response("lever", (2.5, 42.0, 1500.0), 0.35, SENT)
    assert response is not None
    inside = (FREQUENCIES >= 2.0) & (FREQUENCIES <= 8.0)
    for edge, sign in ((response.low, -1.0), (response.high, 1.0)):
        ratio = np.log(edge / response.magnitude)
        np.testing.assert_allclose(ratio[inside], sign * SIGMAS * 0.01 * FREQUENCIES[inside])
        assert np.isnan(ratio[~inside]).all()
    for edge, sign in ((response.phase_low, -1.0), (response.phase_high, 1.0)):
        beside = edge - response.phase
        np.testing.assert_allclose(beside[inside], sign * SIGMAS * DEGREES * 0.002 * FREQUENCIES[inside])
        assert np.isnan(beside[~inside]).all()


@pytest.mark.parametrize(("stiffness", "trim"), [(math.nan, 0.35), (1500.0, math.nan)])
def test_nothing_of_what_is_not_known(stiffness: float, trim: float) -> None:
    assert Geometry(Config()).response("lever", (2.5, 42.0, stiffness), trim, SENT) is None
