"""The truth: a rigid lever on a vertically accelerated base, held by a pilot's arm, in double precision.

    M theta_ddot + (c_p l^2 cos^2 theta + c_l) theta_dot + g l mu cos theta
      + l^2 k_p (sin theta - sin theta_a) cos theta + k_l (theta - theta_l) = -l mu cos theta z_ddot + tau_m
    M = l^2 (eta^2 m_l + m_p) + J_l,  mu = eta m_l + m_p

(DESIGN section 3; tests/python/sil/test_plant.py derives it from the energies.) Preload fixed: theta_a and theta_l are
given. Preload trim: theta_l = theta_0 and sin theta_a = sin theta_0 + g mu / (k_p l), theta_0 a trajectory, so that the
lever always rests at theta_0.

Integration: Euler-Maruyama with process noise on theta_dot [rad/s/sqrt(s)], on substeps of at most a quarter of a
millisecond, the drift by the linearly implicit midpoint rule: second order, one force evaluation. Explicit Euler would
add omega h / 2 to the damping ratio, 1 % of it even at this substep. Between samples the base acceleration is
interpolated, parameters are held, and the torque follows its command with the motor's lag.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from . import truth as truths
from .transfer import Transfer
from .truth import Conditions, Dynamics, FloatArray
from .units import GRAVITY

Preload = Literal["fixed", "trim"]


@dataclass(frozen=True)
class Lever:
    """What is constant in a lever; the names and units are those of the firmware's settings."""

    lever_length: float
    lever_mass: float
    lever_mass_position: float
    lever_inertia: float
    lever_damping: float
    lever_stiffness: float
    arm_preload_angle: float
    lever_preload_angle: float

    @classmethod
    def from_settings(cls, settings: Mapping[str, float]) -> Lever:
        """From a table that has at least these names, in SI units."""
        return cls(**{name: settings[name] for name in cls.__dataclass_fields__})

    @property
    def own_inertia(self) -> float:
        """Inertia about the pivot without the arm, l^2 eta^2 m_l + J_l [kg m^2]."""
        return (self.lever_length * self.lever_mass_position) ** 2 * self.lever_mass + self.lever_inertia


@dataclass(frozen=True)
class Truth:
    """The pilot at every sample: arrays of equal length [kg, N s/m, N/m, rad]. Fixed preload does not use the trim."""

    m_p: FloatArray
    c_p: FloatArray
    k_p: FloatArray
    trim: FloatArray


def inertia(lever: Lever, truth: Truth) -> FloatArray:
    """M of lever and arm [kg m^2]."""
    return lever.own_inertia + lever.lever_length**2 * truth.m_p


def moment(lever: Lever, truth: Truth) -> FloatArray:
    """l mu: torque by vertical acceleration at theta = 0 [kg m]."""
    return lever.lever_length * (lever.lever_mass_position * lever.lever_mass + truth.m_p)


def preload(lever: Lever, truth: Truth, kind: Preload) -> tuple[FloatArray, FloatArray]:
    """(sin theta_a, theta_l): where the arm's and the lever's own spring rest."""
    if kind == "fixed":
        ones = np.ones_like(truth.trim)
        return math.sin(lever.arm_preload_angle) * ones, lever.lever_preload_angle * ones
    weight = GRAVITY * moment(lever, truth) / (truth.k_p * lever.lever_length**2)
    return np.sin(truth.trim) + weight, truth.trim


def stiffness(lever: Lever, truth: Truth, kind: Preload, angle: FloatArray) -> FloatArray:
    """K: the restoring torque per angle at `angle` [N m/rad]."""
    arm_sine, _ = preload(lever, truth, kind)
    sine, cosine = np.sin(angle), np.cos(angle)
    arm = lever.lever_length**2 * truth.k_p * (cosine**2 - (sine - arm_sine) * sine)
    return arm - GRAVITY * moment(lever, truth) * sine + lever.lever_stiffness


def damping(lever: Lever, truth: Truth, angle: FloatArray) -> FloatArray:
    """D: the resisting torque per rate at `angle` [N m s/rad]."""
    damper: FloatArray = lever.lever_length**2 * truth.c_p * np.cos(angle) ** 2 + lever.lever_damping
    return damper


def equilibrium(lever: Lever, truth: Truth, kind: Preload) -> FloatArray:
    """The angle at which the lever rests [rad]: the trim, or with fixed preload where springs and weight balance."""
    if kind == "trim":
        return truth.trim
    arm_sine, lever_angle = preload(lever, truth, kind)
    angle = lever_angle.copy()
    for _ in range(20):  # Newton; 5 suffice for any arm that holds the lever
        sine, cosine = np.sin(angle), np.cos(angle)
        torque = GRAVITY * moment(lever, truth) * cosine + lever.lever_stiffness * (angle - lever_angle)
        torque += lever.lever_length**2 * truth.k_p * (sine - arm_sine) * cosine
        angle -= torque / stiffness(lever, truth, kind, angle)
    return angle


def dynamics(lever: Lever, truth: Truth, kind: Preload) -> Dynamics:
    """omega = sqrt(K / M) / 2 pi [Hz] and zeta = D / (2 sqrt(K M)) [1] at the equilibrium."""
    angle = equilibrium(lever, truth, kind)
    mass, spring = inertia(lever, truth), stiffness(lever, truth, kind, angle)
    damper = damping(lever, truth, angle)
    return Dynamics(np.sqrt(spring / mass) / (2.0 * math.pi), damper / (2.0 * np.sqrt(spring * mass)))


@dataclass(frozen=True)
class LeverTruth(truths.Truth):
    """This lever with its pilot, as a run needs them."""

    model = "lever"
    lever: Lever
    pilot: Truth
    preload: Preload

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        return {"m_p": self.pilot.m_p, "c_p": self.pilot.c_p, "k_p": self.pilot.k_p}

    @property
    def rest(self) -> FloatArray:
        return equilibrium(self.lever, self.pilot, self.preload)

    @property
    def dynamics(self) -> Dynamics:
        return dynamics(self.lever, self.pilot, self.preload)

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        pilot = Truth(*(column[samples] for column in (*self.parameters.values(), self.pilot.trim)))
        angle = equilibrium(self.lever, pilot, self.preload)
        spring = stiffness(self.lever, pilot, self.preload, angle)
        forcing = -moment(self.lever, pilot) * np.cos(angle)
        resistance = (inertia(self.lever, pilot), damping(self.lever, pilot, angle), spring)
        return Transfer(forcing[:, None], np.stack(resistance, axis=1))

    def body(self, conditions: Conditions) -> Plant:
        return Plant(self.lever, self.pilot, self.preload, conditions)


# One sample period, prepared: M, l mu, l^2 c_p, l^2 k_p, sin theta_a, theta_l, [(z_ddot + g, M times noise), ...]
_Row = tuple[float, float, float, float, float, float, list[list[float]]]


def _rows(lever: Lever, truth: Truth, kind: Preload, conditions: Conditions) -> Iterator[_Row]:
    """The sample periods between the samples, in order."""
    mass, arm = inertia(lever, truth), lever.lever_length**2
    arm_sine, lever_angle = preload(lever, truth, kind)
    columns = (mass, moment(lever, truth), arm * truth.c_p, arm * truth.k_p, arm_sine, lever_angle)
    for block, base, normal in conditions.blocks():
        noise = conditions.kick * mass[block, None] * normal
        drive = np.stack((base + GRAVITY, noise), axis=2).tolist()
        yield from zip(*(column[block].tolist() for column in columns), drive, strict=True)


class Plant:
    """Lever, arm and motor: a truth.Body, which starts at rest at the equilibrium."""

    def __init__(self, lever: Lever, truth: Truth, kind: Preload, conditions: Conditions) -> None:
        self.theta = float(equilibrium(lever, truth, kind)[0])
        self.theta_dot = 0.0
        self.tau_m = 0.0
        self._step = conditions.step
        self._lag_middle, self._lag = conditions.decay(0.5), conditions.decay(1.0)
        self._damping = lever.lever_damping
        self._stiffness = lever.lever_stiffness
        self._rows = _rows(lever, truth, kind, conditions)

    def advance(self, command: float) -> None:
        """To the next sample, with the torque `command` [N m] held. Raises StopIteration after the last sample."""
        theta, theta_dot, torque = self.theta, self.theta_dot, self.tau_m - command
        mass, moment, arm_damping, arm_stiffness, arm_sine, lever_angle, drive = next(self._rows)
        step, lag_middle, lag = self._step, self._lag_middle, self._lag
        own_damping, own_stiffness = self._damping, self._stiffness
        sin, cos = math.sin, math.cos
        half = 0.5 * step
        for acceleration, noise in drive:
            middle = theta + half * theta_dot
            cosine = cos(middle)
            damping = arm_damping * cosine * cosine + own_damping
            force = (
                command
                + torque * lag_middle
                - (moment * acceleration + arm_stiffness * (sin(middle) - arm_sine)) * cosine
                - own_stiffness * (middle - lever_angle)
            )
            change = (step * (force - damping * theta_dot) + noise) / (mass + half * damping)
            theta += step * (theta_dot + 0.5 * change)
            theta_dot += change
            torque *= lag
        self.theta, self.theta_dot, self.tau_m = theta, theta_dot, command + torque
