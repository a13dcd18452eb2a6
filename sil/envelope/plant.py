"""Levers and pilots of many runs at once, independent of the filter and of the other truths: RK4, one lane a run.

    M theta_ddot = -l cos(theta) [mu (g + z_ddot) + k_p (l sin theta - r) + c_p l cos(theta) theta_dot]
                   - c_l theta_dot - k_l (theta - theta_l) - T_f theta_dot / sqrt(theta_dot^2 + v_f^2)
                   + tau_m + disturbance

with M = l^2 (eta^2 m_l + m_p) + J_l, mu = eta m_l + m_p. The arm's spring rests at the height r, which the pilot moves
to move the lever: where the lever rests at the trim, so that the weight mu g drops out. A lever that nobody holds
(m_p, c_p, k_p = 0) is balanced. theta_l stays. Inputs are given at the samples and are linear between them; the pilot's
m_p, c_p, k_p and the friction are held.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields

import numpy as np
from lever_cdkf.host_tools.arrays import FloatArray
from numpy.typing import NDArray

STOP_RATE = 2e-3
"""v_f: theta_dot at which friction reaches 71 % of its limit [rad/s]."""


@dataclass(frozen=True)
class Hardware:
    """The lever itself; SI units."""

    length: float = 0.45
    mass: float = 1.2
    mass_position: float = 0.5
    inertia: float = 0.020
    damping: float = 0.5
    stiffness: float = 5.0

    def moving_inertia(self, m_p: FloatArray) -> FloatArray:
        """M [kg m^2]."""
        return self.length**2 * (self.mass_position**2 * self.mass + m_p) + self.inertia

    def forcing_mass(self, m_p: FloatArray) -> FloatArray:
        """mu [kg]."""
        return self.mass_position * self.mass + m_p


@dataclass(frozen=True)
class Lanes:
    """What acts on each lever: arrays of shape (samples, lanes), or (1, lanes) for what does not change."""

    z_ddot: FloatArray
    """Base acceleration without gravity [m/s^2]."""
    tau_m: FloatArray
    """Motor torque that acts [N m]."""
    m_p: FloatArray
    c_p: FloatArray
    k_p: FloatArray
    trim: FloatArray
    """Angle at which the lever rests while the pilot holds still [rad]."""
    disturbance: FloatArray
    """Unmeasured torque [N m]."""
    kick: FloatArray
    """What process noise adds to theta_dot from sample to sample [rad/s]."""
    friction: FloatArray
    """Coulomb friction T_f [N m]."""
    period: float = 1e-3
    """Between samples [s]."""
    hardware: Hardware = field(default_factory=Hardware)

    def at(self, samples: NDArray[np.intp], name: str) -> FloatArray:
        """The rows of an array at these samples."""
        values: FloatArray = getattr(self, name)
        return values[samples if len(values) > 1 else np.zeros_like(samples)]


def beside(parts: list[Lanes]) -> Lanes:
    """The lanes of all, side by side; period and hardware are those of the first."""
    columns = {}
    for each in fields(Lanes):
        arrays = [getattr(part, each.name) for part in parts]
        if isinstance(arrays[0], np.ndarray):
            count = max(len(array) for array in arrays)
            columns[each.name] = np.hstack([np.broadcast_to(array, (count, array.shape[1])) for array in arrays])
    return Lanes(**columns, period=parts[0].period, hardware=parts[0].hardware)


def natural_frequency_and_damping(
    hardware: Hardware, m_p: FloatArray, c_p: FloatArray, k_p: FloatArray, trim: FloatArray, first_trim: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Undamped natural frequency [Hz] and damping ratio [1], linearised about the trim; friction is no damping."""
    inertia, rise = hardware.moving_inertia(m_p), hardware.length * np.cos(trim)
    own = hardware.stiffness * (1.0 + np.tan(trim) * (trim - first_trim))
    omega = np.sqrt((rise**2 * k_p + own) / inertia)
    return omega / (2.0 * np.pi), (rise**2 * c_p + hardware.damping) / (2.0 * omega * inertia)


class Plant:
    """Levers in motion: `theta` [rad] and `theta_dot` [rad/s] of every lane, at the start at rest at the trim."""

    def __init__(self, lanes: Lanes) -> None:
        h = lanes.hardware
        count, width = lanes.z_ddot.shape
        wide = {name: np.broadcast_to(getattr(lanes, name), (count, width)) for name in ("m_p", "c_p", "k_p", "trim")}
        m_p, k_p, trim = wide["m_p"], wide["k_p"], wide["trim"]
        self.theta, self.theta_dot = trim[0].copy(), np.zeros(width)
        self._hardware, self._period = h, lanes.period
        self._spring, self._damper = k_p * h.length, wide["c_p"] * h.length
        rest = self._spring * np.sin(trim) + h.stiffness * (trim - trim[0]) / (h.length * np.cos(trim))
        self._drive = h.forcing_mass(m_p) * lanes.z_ddot
        self._rest = np.where(k_p > 0.0, rest, 0.0)
        self._inverse = np.broadcast_to(1.0 / h.moving_inertia(m_p), (count, width))
        self._torque = np.broadcast_to(lanes.tau_m + lanes.disturbance + h.stiffness * trim[0], (count, width))
        self._friction = np.broadcast_to(lanes.friction, (count, width))
        self._rubs = bool(lanes.friction.any())
        self._kick = np.broadcast_to(lanes.kick, (count, width))

    def advance(self, i: int, begin: FloatArray | float = 0.0, end: FloatArray | float = 0.0) -> None:
        """From sample i to sample i + 1, with further torque [N m] at its begin and end."""
        drives, torques = self._drive[i : i + 2], self._torque[i : i + 2]
        torque0, torque1 = torques[0] + begin, torques[1] + end
        drive, torque = 0.5 * (drives[0] + drives[1]), 0.5 * (torque0 + torque1)
        x, v, period = self.theta, self.theta_dot, self._period
        half = 0.5 * period
        a1 = self._acceleration(i, drives[0], torque0, x, v)
        v2 = v + half * a1
        a2 = self._acceleration(i, drive, torque, x + half * v, v2)
        v3 = v + half * a2
        a3 = self._acceleration(i, drive, torque, x + half * v2, v3)
        v4 = v + period * a3
        a4 = self._acceleration(i, drives[1], torque1, x + period * v3, v4)
        self.theta = x + period / 6.0 * (v + 2.0 * (v2 + v3) + v4)
        self.theta_dot = v + period / 6.0 * (a1 + 2.0 * (a2 + a3) + a4) + self._kick[i]

    def _acceleration(self, i: int, drive: FloatArray, torque: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
        cosine = np.cos(x)
        arm = drive - self._rest[i] + self._spring[i] * np.sin(x) + self._damper[i] * cosine * v
        other = torque - self._hardware.damping * v - self._hardware.stiffness * x
        if self._rubs:
            other -= self._friction[i] * v / np.sqrt(v * v + STOP_RATE**2)
        acceleration: FloatArray = (other - self._hardware.length * cosine * arm) * self._inverse[i]
        return acceleration


def grip_force(lanes: Lanes, theta: FloatArray, theta_dot: FloatArray) -> FloatArray:
    """What the arm does to the lever, mean since the last sample [N]; of its weight, which the rest angle balances,
    nothing. Process noise and disturbance act on the lever."""

    def since(values: FloatArray) -> FloatArray:
        earlier = np.concatenate((values[:1], values[:-1])) if len(values) > 1 else values
        middle: FloatArray = 0.5 * (values + earlier)
        return middle

    length, angle, rate, trim = lanes.hardware.length, since(theta), since(theta_dot), since(lanes.trim)
    acceleration = np.diff(theta_dot, axis=0, prepend=theta_dot[:1]) / lanes.period
    inertial = lanes.m_p * (length * acceleration + since(lanes.z_ddot) * np.cos(angle))
    spring = length * lanes.k_p * (np.sin(angle) - np.sin(trim))
    spring = spring - lanes.hardware.stiffness * (trim - lanes.trim[0]) / (length * np.cos(trim))
    damper = length * lanes.c_p * np.cos(angle) * rate
    force: FloatArray = -inertial - np.cos(angle) * (spring + damper)
    return force


def run(lanes: Lanes, tick: Callable[[], None] = lambda: None) -> tuple[FloatArray, FloatArray]:
    """theta [rad] and theta_dot [rad/s] of every lane at every sample; `tick` is called now and then."""
    plant = Plant(lanes)
    theta, theta_dot = np.empty_like(lanes.z_ddot), np.empty_like(lanes.z_ddot)
    for i in range(len(theta)):
        theta[i], theta_dot[i] = plant.theta, plant.theta_dot
        if i + 1 < len(theta):
            plant.advance(i)
        if i % 1000 == 0:
            tick()
    return theta, theta_dot
