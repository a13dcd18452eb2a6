"""The lever with a trunk that gives way: against its Lagrangian, scipy's integrator, and the lever on a stiff seat."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from lever_cdkf.host_tools.models.transfer import BAND
from lever_cdkf.sil.plants import lever_plant
from lever_cdkf.sil.plants.truth import Conditions
from lever_cdkf.sil.plants.two_dof_plant import TRUNK_DAMPING, TRUNK_MASS, TRUNK_STIFFNESS, Plant, TwoDof
from lever_cdkf.sil.units import GRAVITY
from numpy.typing import NDArray
from scipy import integrate

LEVER = lever_plant.Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, 0.0, 0.0)
PERIOD = 1e-3
ARM = (3.2, 60.0, 2100.0)
TRUNK = (TRUNK_MASS, TRUNK_DAMPING, TRUNK_STIFFNESS)
TRIM = 0.35


def held(arm: tuple[float, ...] = ARM, trunk: tuple[float, ...] = TRUNK, count: int = 2, trim: float = TRIM) -> TwoDof:
    return TwoDof(LEVER, *(np.full(count, value) for value in (*arm, *trunk, trim)))


def body(truth: TwoDof, base: NDArray[np.float64], noise: float = 0.0, substeps: int | None = None) -> Plant:
    return truth.body(Conditions(base, PERIOD, noise, 0.0, np.random.default_rng(1), substeps))


@cache
def lagrange() -> tuple[Any, Any]:
    """Accelerations of (theta, s), and their Jacobian by (theta, s, theta_dot, s_dot, z_ddot), as functions of the
    first four, the parameters, theta_0, z_ddot and tau_m: from energies, dissipation, and springs preloaded for rest at
    theta_0, s = 0."""
    t = sympy.Symbol("t")
    m_p, c_p, k_p, m_t, c_t, k_t, rest, z_ddot, tau = sympy.symbols("m_p c_p k_p m_t c_t k_t rest z_ddot tau")
    symbols = sympy.symbols("angle trunk rate trunk_rate")
    accelerations = sympy.symbols("angular linear")
    theta, s, z = (sympy.Function(name)(t) for name in ("theta", "s", "z"))
    e_0, s_0 = sympy.symbols("e_0 s_0")

    def kinetic(mass: sympy.Expr, distance: sympy.Expr) -> sympy.Expr:
        x, y = distance * sympy.cos(theta), z + distance * sympy.sin(theta)
        return mass * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2

    length, mass, centre = LEVER.lever_length, LEVER.lever_mass, LEVER.lever_mass_position * LEVER.lever_length
    stretch = length * sympy.sin(theta) - s
    energy = kinetic(mass, centre) + kinetic(m_p, length) + LEVER.lever_inertia * theta.diff(t) ** 2 / 2
    energy += m_t * (z + s).diff(t) ** 2 / 2
    potential = (
        GRAVITY * (mass * (z + centre * sympy.sin(theta)) + m_p * (z + length * sympy.sin(theta)) + m_t * (z + s))
        + k_p * (stretch - e_0) ** 2 / 2
        + LEVER.lever_stiffness * (theta - rest) ** 2 / 2
        + k_t * (s - s_0) ** 2 / 2
    )
    dissipation = (c_p * stretch.diff(t) ** 2 + LEVER.lever_damping * theta.diff(t) ** 2 + c_t * s.diff(t) ** 2) / 2
    lagrangian = energy - potential
    equations = []
    for coordinate, force in ((theta, tau), (s, 0)):
        rate = coordinate.diff(t)
        equation = lagrangian.diff(rate).diff(t) - lagrangian.diff(coordinate) + dissipation.diff(rate) - force
        flat = equation.doit().subs(z.diff(t, 2), z_ddot)
        flat = flat.subs([(theta.diff(t, 2), accelerations[0]), (s.diff(t, 2), accelerations[1])])
        flat = flat.subs([(theta.diff(t), symbols[2]), (s.diff(t), symbols[3]), (theta, symbols[0]), (s, symbols[1])])
        equations.append(flat)
    still = dict.fromkeys((*symbols[1:], *accelerations, z_ddot, tau), 0) | {symbols[0]: rest}
    preload = sympy.solve([equation.subs(still) for equation in equations], (e_0, s_0), dict=True)[0]
    solved = sympy.solve([equation.subs(preload) for equation in equations], accelerations, dict=True)[0]
    vector = sympy.Matrix([solved[acceleration] for acceleration in accelerations])
    arguments = (*symbols, m_p, c_p, k_p, m_t, c_t, k_t, rest, z_ddot, tau)
    jacobian = vector.jacobian((*symbols, z_ddot))
    return sympy.lambdify(arguments, vector), sympy.lambdify(arguments, jacobian)


def state_space(truth: TwoDof) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A (4, 4) and B (4,) by z_ddot of the Lagrangian's linearisation at rest; states theta, s, theta_dot, s_dot."""
    values = [column[0] for column in truth.parameters.values()]
    slopes = lagrange()[1](truth.trim[0], 0, 0, 0, *values, truth.trim[0], 0, 0)
    return np.vstack((np.eye(4)[2:], slopes[:, :4])), np.array([0, 0, *slopes[:, 4]])


def test_accelerations_are_those_of_the_lagrangian() -> None:
    random = np.random.default_rng(2)
    low, high = (1, 10, 400, 20, 300, 9000, 0.2), (5, 150, 4000, 80, 3000, 90000, 0.6)
    for _ in range(50):
        values = random.uniform(low, high)
        truth = TwoDof(LEVER, *(np.full(2, value) for value in values))
        theta, s, rate, s_dot, base, torque = random.uniform((-0.1, -0.03, -3, -0.5, -8, -2), (0.9, 0.03, 3, 0.5, 8, 2))
        lever = body(truth, np.full(2, base), substeps=1)
        lever._step = 1e-9  # so short that the increment is the derivative
        lever.theta, lever.s, lever.theta_dot, lever.s_dot = theta, s, rate, s_dot
        lever.advance(torque)
        expected = lagrange()[0](theta, s, rate, s_dot, *values, base, torque)[:, 0]
        found = ((lever.theta_dot - rate) / 1e-9, (lever.s_dot - s_dot) / 1e-9)
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-4)


def test_it_rests_at_the_trim() -> None:
    lever = body(held(count=2000), np.zeros(2000))
    for _ in range(1999):
        lever.advance(0.0)
    assert (lever.theta, lever.s) == pytest.approx((TRIM, 0.0), abs=1e-12)


def test_large_motion_is_that_of_solve_ivp() -> None:
    """A ringing, shaken, pushed lever. Its base is straight between samples: (2 pi 5 Hz 1 ms)^2 / 12 = 8e-5 is lost."""
    count = 1501
    time = np.arange(count) * PERIOD
    truth = held((1.5, 15.0, 900.0), count=count)
    lever = body(truth, 3.0 * np.sin(2 * math.pi * 5.0 * time))
    lever.theta += 0.2
    values = [column[0] for column in truth.parameters.values()]

    def derivative(now: float, x: NDArray[np.float64]) -> list[float]:
        z_ddot = 3.0 * math.sin(2 * math.pi * 5.0 * now)
        return [x[2], x[3], *lagrange()[0](*x, *values, TRIM, z_ddot, 0.4)[:, 0]]

    start = [lever.theta, 0.0, 0.0, 0.0]
    exact = integrate.solve_ivp(derivative, (0, time[-1]), start, t_eval=time, rtol=1e-10, atol=1e-12).y
    path = [(lever.theta, lever.s)]
    for _ in range(count - 1):
        lever.advance(0.4)
        path.append((lever.theta, lever.s))
    for found, expected in zip(np.array(path).T, exact, strict=False):
        assert np.abs(found - expected).max() < 1e-4 * np.ptp(expected)


def test_the_transfer_function_is_that_of_the_linearised_lagrangian() -> None:
    truth = held((2.0, 30.0, 1200.0), count=3)
    system, forcing = state_space(truth)
    frequency = np.linspace(0.5, 12.0, 24)
    for response in truth.transfer(np.array([0, 2])).response(frequency):
        for answer, hertz in zip(response, frequency, strict=True):
            states = np.linalg.solve(2j * math.pi * hertz * np.eye(4) - system, forcing)
            assert answer == pytest.approx(states[0], rel=1e-9)


@pytest.mark.parametrize("arm", [ARM, (1.8, 32.0, 1150.0), (1.0, 20.0, 4000.0)])
def test_the_dynamics_are_those_of_the_eigenvector_that_answers_most(arm: tuple[float, float, float]) -> None:
    """z_ddot drives eigenvector i with (V^-1 B)_i, theta shows it with V_0i; a pole and its twin are one mode."""
    truth = held(arm)
    system, forcing = state_space(truth)
    poles, vectors = np.linalg.eig(system)
    shares = vectors[0] * np.linalg.solve(vectors, forcing.astype(complex))
    s = 2j * math.pi * np.linspace(*BAND, 500)
    strengths = {}
    for pole in poles[poles.imag > 0.0]:
        mine = np.flatnonzero(np.isclose(np.abs(poles), abs(pole)) & np.isclose(poles.real, pole.real))
        strengths[pole] = np.mean(np.abs(sum(shares[i] / (s - poles[i]) for i in mine)) ** 2)
    strongest = max(strengths, key=lambda pole: strengths[pole])
    assert truth.dynamics.natural_frequency == pytest.approx(abs(strongest) / (2 * math.pi), rel=1e-9)
    assert truth.dynamics.damping_ratio == pytest.approx(-strongest.real / abs(strongest), rel=1e-9)


def test_dynamics_follow_the_parameters() -> None:
    truth = held(count=6)
    truth.k_p[2:4] = 3000.0
    found = truth.dynamics.natural_frequency
    soft, stiff = (held((3.2, 60.0, k_p)).dynamics.natural_frequency[0] for k_p in (2100.0, 3000.0))
    assert found == pytest.approx([soft, soft, stiff, stiff, soft, soft])
    assert stiff > soft


def test_on_a_seat_that_does_not_give_way_it_is_the_lever() -> None:
    count = 1000
    base = 2.0 * np.random.default_rng(3).standard_normal(count)
    stiff = held(trunk=(45.0, 1e5, 1e9), count=count)
    conditions = Conditions(base, PERIOD, 0.0, 2e-3, np.random.default_rng(0))
    lever, alone = stiff.body(conditions), lever_plant.Plant(LEVER, stiff.arm, "trim", conditions)
    path = []
    for _ in range(count - 1):
        lever.advance(0.3)
        alone.advance(0.3)
        path.append((lever.theta, alone.theta))
    assert lever.tau_m == alone.tau_m
    found, expected = np.array(path).T
    assert np.abs(found - expected).max() < 1e-4 * np.ptp(expected)
    alone_dynamics = lever_plant.dynamics(LEVER, stiff.arm, "trim")
    assert stiff.dynamics.natural_frequency == pytest.approx(alone_dynamics.natural_frequency, rel=1e-4)
    assert stiff.dynamics.damping_ratio == pytest.approx(alone_dynamics.damping_ratio, rel=1e-4)


def test_process_noise_shakes_the_lever_by_its_strength() -> None:
    count = 20_000
    lever = body(held(count=count), np.zeros(count), noise=0.05)
    kicks = np.empty(count - 1)
    for k in range(count - 1):
        lever.theta, lever.theta_dot, lever.s, lever.s_dot = TRIM, 0.0, 0.0, 0.0
        lever.advance(0.0)
        kicks[k] = lever.theta_dot
    assert np.std(kicks) == pytest.approx(0.05 * math.sqrt(PERIOD), rel=0.03)


def test_the_default_trunk_is_at_four_and_a_half_hertz() -> None:
    omega = math.sqrt(TRUNK_STIFFNESS / TRUNK_MASS)
    assert omega / (2 * math.pi) == pytest.approx(4.5, abs=0.01)
    assert TRUNK_DAMPING / (2 * TRUNK_MASS * omega) == pytest.approx(0.39, abs=0.005)
