"""What the tests of the truths move and derive: a lever under given conditions, and its Lagrangian."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import sympy
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.text.units import GRAVITY
from lever_sil.plants.lever_plant import Lever
from lever_sil.plants.truth import Body, Conditions, Truth

PERIOD, TRIM = 1e-3, 0.35
LEVER = Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, math.radians(20), math.radians(18))


def columns(count: int, *values: float) -> list[FloatArray]:
    return [np.full(count, value) for value in values]


def body(
    truth: Truth,
    base: FloatArray | float = 0.0,
    *,
    noise: float = 0.0,
    lag: float = 0.0,
    substeps: int | None = None,
    disturbance: FloatArray | float = 0.0,
) -> Any:
    """Return the Body of a truth; typed as anything, since tests set the states of those that have some of their
    own."""
    z_ddot = np.broadcast_to(base, len(truth.rest)).astype(np.float64)
    return truth.body(Conditions(z_ddot, PERIOD, noise, lag, np.random.default_rng(1), substeps, disturbance))


def moved(body: Body, count: int, command: float = 0.0) -> FloatArray:
    """Return (samples, 2): theta - trim and theta_dot."""
    path = [(body.theta, body.theta_dot)]
    for _ in range(count - 1):
        body.advance(command)
        path.append((body.theta, body.theta_dot))
    return np.array(path) - (TRIM, 0.0)


@cache
def lagrange(trunk: bool) -> tuple[Any, Any]:
    """Accelerations of the coordinates, and their Jacobian by coordinates, rates and z_ddot, from energies and
    dissipation alone. Coordinates are theta, and with a trunk its deflection s; arguments are coordinates, rates,
    m_p, c_p, k_p, (m_t, c_t, k_t,) z_ddot, tau_m, and what preloads the springs: the stretch of the arm's [m] and the
    angle of the lever's, or with a trunk the angle at which all rests."""
    t = sympy.Symbol("t")
    parameters = m_p, c_p, k_p, m_t, c_t, k_t = sympy.symbols("m_p c_p k_p m_t c_t k_t")
    z_ddot, tau, stretched, own, deflected, rest = sympy.symbols("z_ddot tau stretched own deflected rest")
    theta, z = sympy.Function("theta")(t), sympy.Function("z")(t)
    s = sympy.Function("s")(t) if trunk else sympy.Integer(0)

    def kinetic(mass: sympy.Expr, distance: sympy.Expr) -> sympy.Expr:
        x, y = distance * sympy.cos(theta), z + distance * sympy.sin(theta)
        return mass * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2

    length, mass, centre = LEVER.lever_length, LEVER.lever_mass, LEVER.lever_mass_position * LEVER.lever_length
    stretch = length * sympy.sin(theta) - s
    energy = kinetic(mass, centre) + kinetic(m_p, length) + LEVER.lever_inertia * theta.diff(t) ** 2 / 2
    energy += m_t * (z + s).diff(t) ** 2 / 2
    potential = (
        GRAVITY * (mass * (z + centre * sympy.sin(theta)) + m_p * (z + length * sympy.sin(theta)) + m_t * (z + s))
        + k_p * (stretch - stretched) ** 2 / 2
        + LEVER.lever_stiffness * (theta - own) ** 2 / 2
        + k_t * (s - deflected) ** 2 / 2
    )
    dissipation = (c_p * stretch.diff(t) ** 2 + LEVER.lever_damping * theta.diff(t) ** 2 + c_t * s.diff(t) ** 2) / 2
    lagrangian = energy - potential
    coordinates = (theta, s) if trunk else (theta,)
    angles, rates, accelerations = (sympy.symbols(f"{name}:{len(coordinates)}") for name in ("x", "v", "a"))
    equations = []
    for coordinate, force in zip(coordinates, (tau, 0), strict=False):
        rate = coordinate.diff(t)
        flat = lagrangian.diff(rate).diff(t) - lagrangian.diff(coordinate) + dissipation.diff(rate) - force
        flat = flat.doit().subs(z.diff(t, 2), z_ddot)
        for order, symbols in ((2, accelerations), (1, rates), (0, angles)):
            flat = flat.subs([(each.diff(t, order), to) for each, to in zip(coordinates, symbols, strict=True)])
        equations.append(flat)
    preload: tuple[Any, ...] = (stretched, own)
    if trunk:
        still = dict.fromkeys((*angles[1:], *rates, *accelerations, z_ddot, tau), 0) | {angles[0]: rest, own: rest}
        at_rest = sympy.solve([equation.subs(still) for equation in equations], (stretched, deflected), dict=True)[0]
        equations = [equation.subs(at_rest).subs(own, rest) for equation in equations]
        preload = (rest,)
    solved = sympy.solve(equations, accelerations, dict=True)[0]
    vector = sympy.Matrix([solved[acceleration] for acceleration in accelerations])
    of_arm = parameters if trunk else parameters[:3]
    arguments = (*angles, *rates, *of_arm, z_ddot, tau, *preload)
    slopes = vector.jacobian((*angles, *rates, z_ddot))
    return sympy.lambdify(arguments, vector), sympy.lambdify(arguments, slopes)
