"""lever_feedthrough() through the library: its band is that of the parameters' covariance, by Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.firmware.native import Config, Estimator, Feedthrough
from lever_sil.study.firmware import EXACT
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]
DRAWS = 40_000


def responses(model: str, p: NDArray[np.float64], trim: float, frequency: float) -> ComplexArray:
    """θ/z̈ [rad/(m/s²)] of each row of parameters, from the equations of firmware/THEORY.md with its working values."""
    s = 2j * math.pi * frequency
    first, second, third = p.T
    if model == "linear_physical":
        return np.asarray(first / (first * s**2 + second * s + third))
    if model == "linear_black_box":
        return np.asarray(third / (s**2 - second * s - first))
    if model == "hand":
        return np.asarray(-(1.0 + third / s) / (0.45 * math.cos(trim)) / (s**2 + second * s + first))
    length, mass, place, inertia, c_l, k_l = 0.45, 1.2, 0.5, 0.020, 0.5, 5.0
    square = (length * math.cos(trim)) ** 2
    total = length**2 * (place**2 * mass + first) + inertia
    forcing = -length * (place * mass + first) * math.cos(trim)
    return np.asarray(forcing / (total * s**2 + (square * second + c_l) * s + square * third + k_l))


LEVER = (0.5873, 8.01, 273.2, -1.311)
"""Inertia, damping, stiffness and forcing of 2.5 kg, 42 N s/m, 1500 N/m on the lever."""
PLANTS = {"lever": LEVER, "linear_black_box": LEVER, "linear_physical": (2.5, 42.0, 1500.0, 2.5), "hand": LEVER}


def swing(estimator: Estimator, plant: tuple[float, float, float, float], seconds: float) -> None:
    """Shake a plant at random, integrated by small steps."""
    inertia, damping, stiffness, forcing = plant
    rng = np.random.default_rng(4)
    noise = np.convolve(rng.standard_normal(round(seconds * 1000) + 60), np.hanning(60) / 4.0, "valid")
    theta, rate = 0.0, 0.0
    for k, z_ddot in enumerate(noise[: round(seconds * 1000)].tolist()):
        torque = 0.4 * math.sin(2.0 * math.pi * 4.3 * k * 1e-3)
        rate += 1e-3 * (torque + forcing * z_ddot - damping * rate - stiffness * theta) / inertia
        theta += 1e-3 * rate
        estimator.update(1000 * k, 0.349 + theta + 3e-4 * rng.standard_normal(), rate, torque, z_ddot)


@pytest.mark.parametrize("model", ["lever", "linear_physical", "linear_black_box", "hand"])
@pytest.mark.requirement("R10")
def test_value_and_band_are_those_of_the_parameters_and_their_covariance(model: str) -> None:
    estimator = Estimator(Config(model=model, settings=EXACT))
    swing(estimator, PLANTS[model], 20.0)  # until the black box, too, is known well enough for a first order
    estimate = estimator.estimate()
    p, sigma = np.array(estimate.parameter), np.array(estimate.parameter_sigma)
    a, b, c = estimate.parameter_correlation
    correlation = np.array([[1.0, a, b], [a, 1.0, c], [b, c, 1.0]])
    normal = np.random.default_rng(9).multivariate_normal(np.zeros(3), correlation, DRAWS)
    drawn = p + sigma * normal if model == "linear_black_box" else p * np.exp(sigma / p * normal)
    for frequency in (2.0, 3.5, 8.0):
        found = estimator.feedthrough(frequency)
        (expected,) = responses(model, p[np.newaxis], estimate.trim, frequency)
        assert found.response == pytest.approx(expected, rel=1e-5)
        errors = responses(model, drawn, estimate.trim, frequency) / expected
        assert found.gain_sigma == pytest.approx(np.std(errors.real), rel=0.06)
        assert found.phase_sigma == pytest.approx(np.std(errors.imag), rel=0.06)
        assert found.correlation == pytest.approx(np.corrcoef(errors.real, errors.imag)[0, 1], abs=0.06)


def test_a_trunk_on_its_seat_is_part_of_the_response() -> None:
    """The first guess about 0 rad; the arm's spring and damper act on theta less what the trunk does."""
    frequency, zeta = 4.5, 0.4
    estimator = Estimator(Config(settings={"seat_frequency": frequency, "seat_damping_ratio": zeta}))
    for f in (2.0, 4.0, 8.0):
        s, omega = 2j * math.pi * f, 2.0 * math.pi * frequency
        trunk = -1.0 / (s**2 + 2.0 * zeta * omega * s + omega**2)  # its height in the cabin over z_ddot
        inertia, own, arm = 0.5870, 0.5 * s + 5.0, 0.45**2 * (42.0 * s + 1500.0)
        expected = (-0.45 * 3.1 + arm * trunk / 0.45) / (inertia * s**2 + own + arm)
        assert estimator.feedthrough(f).response == pytest.approx(expected, rel=1e-4)


def test_what_is_not_defined_is_not_finite() -> None:
    estimator = Estimator(Config(model="linear_black_box", settings={"b21": 0.0}))
    assert isinstance(estimator.feedthrough(3.0), Feedthrough)
    assert not math.isfinite(estimator.feedthrough(3.0).gain_sigma)
