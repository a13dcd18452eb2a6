"""A truth that no model of the firmware is: the pilot's trunk gives way on its seat, and the arm hangs on the trunk.

The lever pivots on the cabin floor, whose height is z. The trunk, of mass m_t and height z + s, stands on the seat's
spring k_t and damper c_t. The arm's mass m_p moves with the grip; its spring k_p and damper c_p are between trunk and
grip, whose vertical distance is stretched by e = l sin theta - s:

    T = m_l |v_centre|^2 / 2 + J_l theta_dot^2 / 2 + m_p |v_grip|^2 / 2 + m_t (z_dot + s_dot)^2 / 2
    V = g (m_l (z + eta l sin theta) + m_p (z + l sin theta) + m_t (z + s))
        + k_p (e - e_0)^2 / 2 + k_l (theta - theta_l)^2 / 2 + k_t (s - s_0)^2 / 2
    R = c_p e_dot^2 / 2 + c_l theta_dot^2 / 2 + c_t s_dot^2 / 2              (Rayleigh's dissipation)

Springs are preloaded so that all rests at theta = theta_0, s = 0, whatever the parameters: theta_l = theta_0,
e_0 = l sin theta_0 + g mu / k_p, s_0 = g (m_t + mu) / k_t. Lagrange's equations (tests/python/plants has them again):

    M theta_ddot + l cos(theta) F + c_l theta_dot + k_l (theta - theta_0) = -l mu cos(theta) z_ddot + tau_m + tau_d
    m_t s_ddot - F + c_t s_dot + k_t s = -m_t z_ddot
    F = k_p (l (sin theta - sin theta_0) - s) + c_p (l cos(theta) theta_dot - s_dot)

with M, mu, tau_d and the friction beside c_l as in lever_plant.py; a rigid seat (k_t unbounded) makes it that lever.

The trunk's default is 45 kg at 4.5 Hz with a damping ratio of 0.39. On a rigid seat 60 people had their main resonance
at 5 Hz with a damping ratio of 0.475 (Fairley and Griffin, J. Biomechanics 22, 1989); a cushion in series lowers both.

The dynamics are those of the dominant mode of theta/z_ddot (transfer.py). Integration as in lever_plant.py, the
linearly implicit midpoint rule with a damping matrix of two by two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from . import lever_plant
from .truth import Body, Conditions, ManyModes

TRUNK_MASS, TRUNK_DAMPING, TRUNK_STIFFNESS = 45.0, 1000.0, 36000.0
"""m_t [kg], c_t [N s/m] and k_t [N/m] where nothing else is said."""


@dataclass(frozen=True)
class TwoDof(ManyModes):
    """The lever, and the pilot at every sample: arrays of equal length [kg, N s/m, N/m, rad]."""

    model = "two_dof"
    names = ("m_p", "c_p", "k_p", "m_t", "c_t", "k_t")
    lever: lever_plant.Lever
    m_p: FloatArray
    c_p: FloatArray
    k_p: FloatArray
    m_t: FloatArray
    c_t: FloatArray
    k_t: FloatArray
    trim: FloatArray

    @property
    def arm(self) -> lever_plant.Truth:
        """The arm alone."""
        return lever_plant.Truth(self.m_p, self.c_p, self.k_p, self.trim)

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """By Cramer's rule from the two equations, linearised; a = l cos theta_0 is the grip's rise per angle."""
        at = {name: values[samples, None] for name, values in self.parameters.items()}
        lever, ones = self.lever, np.ones((len(samples), 1))
        rise = lever.lever_length * np.cos(self.trim[samples, None])
        inertia, moment = (f(lever, self.arm)[samples, None] for f in (lever_plant.inertia, lever_plant.moment))
        arm = np.hstack((0.0 * ones, at["c_p"], at["k_p"]))
        own = np.hstack((inertia, lever.lever_damping * ones, lever.lever_stiffness * ones))
        trunk = np.hstack((at["m_t"], at["c_t"], at["k_t"])) + arm
        forcing = -moment * np.cos(self.trim[samples, None])
        numerator = forcing * trunk - rise * at["m_t"] * arm
        return Transfer(numerator, _product(own + rise**2 * arm, trunk) - rise**2 * _product(arm, arm))

    def body(self, conditions: Conditions) -> TwoDofPlant:
        """Return the lever and the trunk at the first sample, at rest."""
        return TwoDofPlant(self, conditions)


def _product(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the products of polynomials of second order, row by row."""
    product = np.zeros((len(left), 5))
    for power in range(3):
        product[:, power : power + 3] += left[:, power, None] * right
    return product


def coefficients(truth: TwoDof) -> tuple[FloatArray, ...]:
    """At every sample: M, l mu, m_t, c_p, k_p, c_t, k_t, sin theta_0, theta_0."""
    mass, moment = lever_plant.inertia(truth.lever, truth.arm), lever_plant.moment(truth.lever, truth.arm)
    springs = (truth.m_t, truth.c_p, truth.k_p, truth.c_t, truth.k_t)
    return (mass, moment, *springs, np.sin(truth.trim), truth.trim)


class TwoDofPlant(Body):
    """Lever, arm, trunk and motor: a truth.Body; `s` and `s_dot` are the trunk's [m, m/s]."""

    def __init__(self, truth: TwoDof, conditions: Conditions) -> None:
        super().__init__(float(truth.trim[0]), conditions)
        self.s = 0.0
        self.s_dot = 0.0
        self._lever = truth.lever
        self._rows = conditions.rows(coefficients(truth))

    def advance(self, command: float) -> None:
        """To the next sample, with the torque `command` [N m] held. Raise StopIteration after the last sample."""
        theta, theta_dot, s, s_dot, torque = self.theta, self.theta_dot, self.s, self.s_dot, self.tau_m - command
        inertia, moment, m_t, c_p, k_p, c_t, k_t, rest_sine, rest, drive = next(self._rows)
        step, lag_middle, lag = self._step, self._lag_middle, self._lag
        length, own_stiffness = self._lever.lever_length, self._lever.lever_stiffness
        half = 0.5 * step
        for base, kick, push in drive:
            middle, trunk = theta + half * theta_dot, s + half * s_dot
            cosine = math.cos(middle)
            rise = length * cosine
            arm = k_p * (length * (math.sin(middle) - rest_sine) - trunk) + c_p * (rise * theta_dot - s_dot)
            lever = command + torque * lag_middle - moment * cosine * base - rise * arm
            resistance, slope = lever_plant.resistance(self._lever, theta_dot)
            lever -= resistance + own_stiffness * (middle - rest)
            seat = arm - m_t * base - c_t * s_dot - k_t * trunk
            lever, seat = step * lever + (inertia * kick + push), step * seat
            cross = -half * c_p * rise
            lever_mass, trunk_mass = inertia + half * slope - cross * rise, m_t + half * (c_p + c_t)
            determinant = lever_mass * trunk_mass - cross * cross
            change = (trunk_mass * lever - cross * seat) / determinant
            trunk_change = (lever_mass * seat - cross * lever) / determinant
            theta += step * (theta_dot + 0.5 * change)
            theta_dot += change
            s += step * (s_dot + 0.5 * trunk_change)
            s_dot += trunk_change
            torque *= lag
        self.theta, self.theta_dot, self.s, self.s_dot, self.tau_m = theta, theta_dot, s, s_dot, command + torque
