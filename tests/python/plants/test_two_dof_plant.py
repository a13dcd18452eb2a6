"""The lever with a trunk that gives way: against its Lagrangian and scipy's integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.models.transfer import BAND
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.plants.two_dof_plant import TRUNK_DAMPING, TRUNK_MASS, TRUNK_STIFFNESS, TwoDof
from python.plants.motion import LEVER, PERIOD, TRIM, body, columns, lagrange
from scipy import integrate

ARM = (3.2, 60.0, 2100.0)
TRUNK = (TRUNK_MASS, TRUNK_DAMPING, TRUNK_STIFFNESS)


def held(arm: tuple[float, ...] = ARM, count: int = 2) -> TwoDof:
    return TwoDof(LEVER, *columns(count, *arm, *TRUNK, TRIM))


def state_space(arm: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return a (4, 4) and B (4,) by z_ddot of the Lagrangian's linearisation at rest; states theta, s, theta_dot,
    s_dot."""
    slopes = lagrange(True)[1](TRIM, 0, 0, 0, *arm, *TRUNK, 0, 0, TRIM)
    return np.vstack((np.eye(4)[2:], slopes[:, :4])), np.array([0, 0, *slopes[:, 4]])


def test_accelerations_are_those_of_the_lagrangian() -> None:
    random = np.random.default_rng(2)
    low, high = (1, 10, 400, 20, 300, 9000, 0.2), (5, 150, 4000, 80, 3000, 90000, 0.6)
    for _ in range(20):
        *values, trim = random.uniform(low, high)
        theta, s, rate, s_dot, base, torque = random.uniform((-0.1, -0.03, -3, -0.5, -8, -2), (0.9, 0.03, 3, 0.5, 8, 2))
        lever = body(TwoDof(LEVER, *columns(2, *values, trim)), base, substeps=1)
        lever._step = 1e-9  # so short that the increment is the derivative
        lever.theta, lever.s, lever.theta_dot, lever.s_dot = theta, s, rate, s_dot
        lever.advance(torque)
        expected = lagrange(True)[0](theta, s, rate, s_dot, *values, base, torque, trim)[:, 0]
        found = ((lever.theta_dot - rate) / 1e-9, (lever.s_dot - s_dot) / 1e-9)
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-4)


def test_large_motion_is_that_of_solve_ivp() -> None:
    """A ringing, shaken, pushed lever. Its base is straight between samples: (2 pi 5 Hz 1 ms)^2 / 12 = 8e-5 is lost."""
    arm, time = (1.5, 15.0, 900.0), np.arange(801) * PERIOD
    lever = body(held(arm, count=801), 3.0 * np.sin(2 * math.pi * 5.0 * time))
    lever.theta += 0.2

    def derivative(now: float, x: FloatArray) -> list[float]:
        z_ddot = 3.0 * math.sin(2 * math.pi * 5.0 * now)
        return [x[2], x[3], *lagrange(True)[0](*x, *arm, *TRUNK, z_ddot, 0.4, TRIM)[:, 0]]

    start = [lever.theta, 0.0, 0.0, 0.0]
    exact = integrate.solve_ivp(derivative, (0, time[-1]), start, t_eval=time, rtol=1e-10, atol=1e-12).y
    path = [(lever.theta, lever.s)]
    for _ in time[1:]:
        lever.advance(0.4)
        path.append((lever.theta, lever.s))
    for found, expected in zip(np.array(path).T, exact, strict=False):
        assert np.abs(found - expected).max() < 1e-4 * np.ptp(expected)


@pytest.mark.parametrize("arm", [ARM, (1.8, 32.0, 1150.0), (1.0, 20.0, 4000.0)])
def test_transfer_function_and_dynamics_are_those_of_the_linearised_lagrangian(arm: tuple[float, float, float]) -> None:
    """z_ddot drives eigenvector i with (V^-1 B)_i, theta shows it with V_0i; a pole and its twin are one mode. The
    dynamics are those of the one that answers most."""
    truth = held(arm)
    system, forcing = state_space(arm)
    poles, vectors = np.linalg.eig(system)
    shares = vectors[0] * np.linalg.solve(vectors, forcing.astype(complex))
    frequency = np.linspace(*BAND, 500)
    s = 2j * math.pi * frequency
    answer = sum(share / (s - pole) for share, pole in zip(shares, poles, strict=True))
    np.testing.assert_allclose(truth.transfer(np.array([1])).response(frequency)[0], answer, rtol=1e-9)
    strengths = {}
    for pole in poles[poles.imag > 0.0]:
        mine = np.flatnonzero(np.isclose(np.abs(poles), abs(pole)) & np.isclose(poles.real, pole.real))
        strengths[pole] = np.mean(np.abs(sum(shares[i] / (s - poles[i]) for i in mine)) ** 2)
    strongest = max(strengths, key=lambda pole: strengths[pole])
    assert truth.dynamics.natural_frequency == pytest.approx(abs(strongest) / (2 * math.pi), rel=1e-9)
    assert truth.dynamics.damping_ratio == pytest.approx(-strongest.real / abs(strongest), rel=1e-9)
