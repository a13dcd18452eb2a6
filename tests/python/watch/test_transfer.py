"""θ/z̈ and its band: against the roots of the model's equations, and against Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.host_tools.config import Config
from lever_cdkf.sil.watch.transfer import FREQUENCIES, SIGMAS, Geometry

DEGREES = 180.0 / math.pi
NO_SIGMA = (0.0, 0.0, 0.0)


def lever_response(frequency: float, m_p: float, c_p: float, k_p: float, trim: float) -> complex:
    """DESIGN section 3 linearised by hand, with the working values of the lever [rad/(m/s²)]."""
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


CASES = [
    ("lever", (2.5, 42.0, 1500.0), [lever_response(f, 2.5, 42.0, 1500.0, 0.35) for f in FREQUENCIES]),
    ("linear_physical", (2.7, 42.0, 1500.0), [physical_response(f, 2.7, 42.0, 1500.0) for f in FREQUENCIES]),
    ("linear_black_box", (-500.0, -14.0, -2.0), [black_box_response(f, -500.0, -14.0, -2.0) for f in FREQUENCIES]),
    ("linear_black_box", (-500.0, -14.0, 2.0), [black_box_response(f, -500.0, -14.0, 2.0) for f in FREQUENCIES]),
]


@pytest.mark.parametrize(("model", "parameters", "expected"), CASES)
def test_response(model: str, parameters: tuple[float, float, float], expected: list[complex]) -> None:
    response = Geometry(Config(model=model)).response(model, parameters, NO_SIGMA, (0.0, 0.0), 0.35)
    assert response is not None
    values = np.array(expected)
    np.testing.assert_allclose(response.magnitude, DEGREES * np.abs(values), rtol=1e-6)
    phasor = np.exp(1j * np.radians(response.phase))
    np.testing.assert_allclose(phasor, values / np.abs(values), atol=1e-6)
    assert np.all(np.abs(np.diff(response.phase)) < 20.0)  # goes on, instead of jumping by 360
    np.testing.assert_array_equal(response.factor, 1.0)
    np.testing.assert_array_equal(response.phase_half_band, 0.0)


def test_the_band_is_what_independent_errors_make() -> None:
    """The black box, whose three coefficients are ω², 2 ζ ω and b themselves, drawn at random."""
    rng, count = np.random.default_rng(3), 20_000
    frequency, damping, gain = 3.5, 0.3, 2.0
    sigmas = (0.05, 0.015, 0.04)  # of frequency, damping, gain
    w = 2 * np.pi * (frequency + sigmas[0] * rng.standard_normal(count))
    zeta = damping + sigmas[1] * rng.standard_normal(count)
    b = gain + sigmas[2] * rng.standard_normal(count)
    chosen = slice(None, None, 10)
    s = 2j * np.pi * FREQUENCIES[chosen, None]
    drawn = b / (s**2 + 2 * zeta * w * s + w**2)
    w_0 = 2 * math.pi * frequency
    response = Geometry(Config(model="linear_black_box")).response(
        "linear_black_box",
        (-(w_0**2), -2 * damping * w_0, gain),
        (0.0, 0.0, sigmas[2]),
        (sigmas[0], sigmas[1]),
        0.35,
    )
    assert response is not None
    log_sigma = np.std(np.log(np.abs(drawn)), axis=1)
    phase_sigma = np.degrees(np.std(np.unwrap(np.angle(drawn), axis=0), axis=1))
    np.testing.assert_allclose(np.log(response.factor[chosen]) / SIGMAS, log_sigma, rtol=0.05)
    np.testing.assert_allclose(response.phase_half_band[chosen] / SIGMAS, phase_sigma, rtol=0.05, atol=0.02)


def test_the_gain_of_the_lever_hardly_depends_on_the_mass() -> None:
    """DESIGN section 3: ∂ln b/∂ln m_p ≈ -0.06, so 50 % in m_p are 3 % in b, and nothing else acts at 0 sigma."""
    response = Geometry(Config()).response("lever", (2.5, 42.0, 1500.0), (1.25, 0.0, 0.0), (0.0, 0.0), 0.35)
    assert response is not None
    np.testing.assert_allclose(np.log(response.factor) / SIGMAS, 0.5 * 0.06, rtol=0.3)


@pytest.mark.parametrize(
    ("parameters", "sigmas", "dynamics_sigmas", "trim"),
    [
        ((math.nan, 42.0, 1500.0), (0.1, 1.0, 10.0), (0.1, 0.1), 0.35),
        ((2.5, 42.0, 1500.0), (0.1, math.nan, 10.0), (0.1, 0.1), 0.35),
        ((2.5, 42.0, 1500.0), (0.1, 1.0, 10.0), (math.nan, 0.1), 0.35),
        ((2.5, 42.0, 1500.0), (0.1, 1.0, 10.0), (0.1, 0.1), math.nan),
    ],
)
def test_nothing_of_what_is_not_known(
    parameters: tuple[float, ...], sigmas: tuple[float, ...], dynamics_sigmas: tuple[float, float], trim: float
) -> None:
    assert Geometry(Config()).response("lever", parameters, sigmas, dynamics_sigmas, trim) is None


def test_what_does_not_swing_has_no_response() -> None:
    geometry = Geometry(Config(model="linear_black_box"))
    assert geometry.response("linear_black_box", (500.0, -14.0, 2.0), NO_SIGMA, (0.0, 0.0), 0.35) is None
    assert geometry.response("linear_black_box", (-500.0, -14.0, 0.0), NO_SIGMA, (0.0, 0.0), 0.35) is None
