"""The truth: a rigid lever on a vertically accelerated base, held by a pilot's arm, in double precision.

    M theta_ddot + (c_p l^2 cos^2 theta + c_l) theta_dot + T_f theta_dot / sqrt(theta_dot^2 + v_f^2) + g l mu cos theta
      + l^2 k_p (sin theta - sin theta_a) cos theta + k_l (theta - theta_l) = -l mu cos theta z_ddot + tau_m + tau_d
    M = l^2 (eta^2 m_l + m_p) + J_l,  mu = eta m_l + m_p

(firmware/THEORY.md; tests/python/plants/test_lever_plant derives it from the energies.) T_f: Coulomb friction;
tau_d a disturbance. Preload fixed: theta_a and theta_l are given. Preload trim: theta_l = theta_0 and sin theta_a =
sin theta_0 + g mu / (k_p l), theta_0 a trajectory, so that the lever always rests at theta_0. Weight has no part in the
motion then, so nothing falls when the hand lets go (m_p = c_p = k_p = 0): a balance carries the lever, and its own
spring pulls it to the trim.

Integration: Euler-Maruyama with process noise on theta_dot [rad/s/sqrt(s)], on substeps of at most a quarter of a
millisecond, the drift by the linearly implicit midpoint rule: second order, one force evaluation, and stable however
steep the friction is. Explicit Euler would add omega h / 2 to the damping ratio, 1 % of it even at this substep.
Between samples the base acceleration and the disturbance are interpolated, parameters are held, and the torque follows
its command with the motor's lag.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.text.units import GRAVITY
from numpy.typing import NDArray

from . import truth as truths
from .truth import Body, Conditions, Dynamics

Preload = Literal["fixed", "trim"]

STOP_RATE = 2e-3
"""v_f: the rate at which friction reaches 71 % of its limit [rad/s]."""


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
    lever_friction: float = 0.0

    @classmethod
    def from_settings(cls, settings: Mapping[str, float]) -> Lever:
        """From a table that has at least these names but those with a default, in SI units."""
        return cls(**{name: settings[name] for name in cls.__dataclass_fields__ if name in settings})

    @property
    def own_moment(self) -> float:
        """First moment of mass about the pivot without the arm, l eta m_l [kg m]."""
        return self.lever_length * self.lever_mass_position * self.lever_mass

    @property
    def own_inertia(self) -> float:
        """Inertia about the pivot without the arm, l^2 eta^2 m_l + J_l [kg m^2]."""
        return (self.lever_length * self.lever_mass_position) ** 2 * self.lever_mass + self.lever_inertia


@dataclass(frozen=True)
class Truth:
    """The pilot at every sample: arrays of equal length [kg, N s/m, N/m, rad].

    They are 0, 0, 0 while the hands are off the lever. Fixed preload does not use the trim.
    """

    m_p: FloatArray
    c_p: FloatArray
    k_p: FloatArray
    trim: FloatArray


def inertia(lever: Lever, truth: Truth) -> FloatArray:
    """M of lever and arm [kg m^2]."""
    return lever.own_inertia + lever.lever_length**2 * truth.m_p


def moment(lever: Lever, truth: Truth) -> FloatArray:
    """Return l mu: the torque by vertical acceleration at theta = 0 [kg m]."""
    return lever.lever_length * (lever.lever_mass_position * lever.lever_mass + truth.m_p)


def preload(lever: Lever, truth: Truth, kind: Preload) -> tuple[FloatArray, FloatArray]:
    """Return the torque by which arm's preload and weight turn the lever, per cosine [N m], and theta_l.

    That torque is l^2 k_p sin theta_a - g l mu.
    """
    arm = lever.lever_length**2 * truth.k_p
    if kind == "trim":
        return arm * np.sin(truth.trim), truth.trim
    hold = arm * math.sin(lever.arm_preload_angle) - GRAVITY * moment(lever, truth)
    return hold, np.full_like(hold, lever.lever_preload_angle)


def weight(kind: Preload) -> float:
    """Return what gravity [m/s^2] the lever's own mass feels: in preload trim a balance carries it."""
    return GRAVITY if kind == "fixed" else 0.0


def stiffness(lever: Lever, truth: Truth, kind: Preload, angle: FloatArray) -> FloatArray:
    """K: the restoring torque per angle at `angle` [N m/rad]."""
    hold, _ = preload(lever, truth, kind)
    sine, cosine = np.sin(angle), np.cos(angle)
    arm = lever.lever_length**2 * truth.k_p
    spring: FloatArray = arm * cosine**2 - (arm * sine - hold) * sine + lever.lever_stiffness
    return spring


def damping(lever: Lever, truth: Truth, angle: FloatArray) -> FloatArray:
    """D: the resisting torque per rate at `angle`, but for friction [N m s/rad]."""
    damper: FloatArray = lever.lever_length**2 * truth.c_p * np.cos(angle) ** 2 + lever.lever_damping
    return damper


def equilibrium(lever: Lever, truth: Truth, kind: Preload) -> FloatArray:
    """Return the angle at which the lever rests [rad].

    It is the trim, or with fixed preload where springs and weight balance.
    """
    if kind == "trim":
        return truth.trim
    hold, lever_angle = preload(lever, truth, kind)
    angle = lever_angle.copy()
    for _ in range(20):  # Newton; 5 suffice for any arm that holds the lever
        torque = (lever.lever_length**2 * truth.k_p * np.sin(angle) - hold) * np.cos(angle)
        torque += lever.lever_stiffness * (angle - lever_angle)
        angle -= torque / stiffness(lever, truth, kind, angle)
    return angle


def dynamics(lever: Lever, truth: Truth, kind: Preload) -> Dynamics:
    """Return omega = sqrt(K / M) / 2 pi [Hz] and zeta = D / (2 sqrt(K M)) [1] at the equilibrium."""
    angle = equilibrium(lever, truth, kind)
    mass, spring = inertia(lever, truth), stiffness(lever, truth, kind, angle)
    damper = damping(lever, truth, angle)
    return Dynamics(np.sqrt(spring / mass) / (2.0 * math.pi), damper / (2.0 * np.sqrt(spring * mass)))


def resistance(lever: Lever, rate: float) -> tuple[float, float]:
    """Return torque [N m] by which the lever's own damper and friction resist, and its slope [N m s/rad]."""
    torque, slope = lever.lever_damping * rate, lever.lever_damping
    if lever.lever_friction > 0.0:
        speed = math.sqrt(rate * rate + STOP_RATE * STOP_RATE)
        friction, ratio = lever.lever_friction / speed, STOP_RATE / speed
        torque += friction * rate
        slope += friction * (ratio * ratio)
    return torque, slope


@dataclass(frozen=True)
class LeverTruth(truths.Truth):
    """A lever of this model with its pilot, as a run needs them."""

    model = "lever"
    has_grip_force = True
    lever: Lever
    pilot: Truth
    preload: Preload

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        """m_p [kg], c_p [N s/m] and k_p [N/m]; NaN while nobody holds the lever."""
        return {name: np.where(self._held, getattr(self.pilot, name), np.nan) for name in ("m_p", "c_p", "k_p")}

    @property
    def rest(self) -> FloatArray:
        """The trim angle, or with fixed preload the angle at which springs and weight balance [rad]."""
        return equilibrium(self.lever, self.pilot, self.preload)

    @property
    def dynamics(self) -> Dynamics:
        """Natural frequency [Hz] and damping ratio about the rest angle; NaN while nobody holds the lever."""
        pilot_dynamics = dynamics(self.lever, self._pilot(self._held), self.preload)
        columns = np.full((2, len(self._held)), np.nan)
        columns[:, self._held] = pilot_dynamics.natural_frequency, pilot_dynamics.damping_ratio
        return Dynamics(*columns)

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """Return theta/z_ddot of lever and arm, linearised about the rest angle."""
        pilot = self._pilot(samples)
        angle = equilibrium(self.lever, pilot, self.preload)
        spring = stiffness(self.lever, pilot, self.preload, angle)
        forcing = -moment(self.lever, pilot) * np.cos(angle)
        resistance = (inertia(self.lever, pilot), damping(self.lever, pilot, angle), spring)
        return Transfer(forcing[:, None], np.stack(resistance, axis=1))

    @property
    def _held(self) -> NDArray[np.bool_]:
        held: NDArray[np.bool_] = self.pilot.m_p > 0.0
        return held

    def _pilot(self, samples: NDArray[np.intp] | NDArray[np.bool_]) -> Truth:
        return Truth(*(column[samples] for column in vars(self.pilot).values()))

    def body(self, conditions: Conditions) -> LeverPlant:
        """Return the nonlinear lever and arm at the first sample."""
        return LeverPlant(self.lever, self.pilot, self.preload, conditions)


def coefficients(lever: Lever, truth: Truth, kind: Preload) -> tuple[FloatArray, ...]:
    """At every sample: M, l mu, l^2 c_p, l^2 k_p, preload's torque, theta_l."""
    arm = lever.lever_length**2
    hold, lever_angle = preload(lever, truth, kind)
    return inertia(lever, truth), moment(lever, truth), arm * truth.c_p, arm * truth.k_p, hold, lever_angle


class LeverPlant(Body):
    """Lever, arm and motor: a truth.Body, which starts at rest at the equilibrium.

    The grip force is what the lever's own equation of motion, over the last period, leaves to the hand; process noise
    and disturbance act on the lever.
    """

    def __init__(self, lever: Lever, truth: Truth, kind: Preload, conditions: Conditions) -> None:
        super().__init__(float(equilibrium(lever, truth, kind)[0]), conditions)
        self.grip_force = 0.0
        self._weight = weight(kind)
        self._lever = lever
        self._rows = conditions.rows(coefficients(lever, truth, kind))

    def advance(self, command: float, reflex: float = 0.0) -> None:
        """Go to the next sample, with the torque `command` and one of the arm [N m] held.

        Raise StopIteration after the last sample.
        """
        theta, theta_dot, torque = self.theta, self.theta_dot, self.tau_m - command
        mass, moment, arm_damping, arm_stiffness, hold, lever_angle, substeps = next(self._rows)
        drive = [(acceleration, mass * kick, push) for acceleration, kick, push in substeps]
        lever, step, lag_middle, lag = self._lever, self._step, self._lag_middle, self._lag
        own_stiffness, held = lever.lever_stiffness, command + reflex
        sin, cos = math.sin, math.cos
        half = 0.5 * step
        begin, begin_dot, motors = theta, theta_dot, 0.0
        for acceleration, kick, push in drive:
            middle = theta + half * theta_dot
            cosine = cos(middle)
            resisting, slope = resistance(lever, theta_dot)
            damping = arm_damping * cosine * cosine
            motor = torque * lag_middle
            motors += motor
            force = (
                held
                + motor
                - (moment * acceleration + arm_stiffness * sin(middle) - hold) * cosine
                - own_stiffness * (middle - lever_angle)
                - damping * theta_dot
                - resisting
            )
            change = (step * force + (kick + push)) / (mass + half * (damping + slope))
            theta += step * (theta_dot + 0.5 * change)
            theta_dot += change
            torque *= lag
        self.theta, self.theta_dot, self.tau_m = theta, theta_dot, command + torque
        self.grip_force = self._force_on_lever(begin, begin_dot, drive, lever_angle, command + motors / len(drive))

    def _force_on_lever(
        self, begin: float, begin_dot: float, drive: list[tuple[float, float, float]], lever_angle: float, motor: float
    ) -> float:
        """Return the mean force of the hand [N] since the lever was at `begin` with the rate `begin_dot`.

        It is right to second order in the period.
        """
        lever, period = self._lever, self._step * len(drive)
        middle = 0.5 * (begin + self.theta)
        acceleration, kick, push = (sum(column) for column in zip(*drive, strict=True))
        own = lever.own_inertia * (self.theta_dot - begin_dot) / period
        own += resistance(lever, (self.theta - begin) / period)[0] + lever.lever_stiffness * (middle - lever_angle)
        own += lever.own_moment * (acceleration / len(drive) + self._weight) * math.cos(middle)
        force: float = (own - motor - (kick + push) / period) / lever.lever_length
        return force
