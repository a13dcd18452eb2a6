"""Levers and pilots of many runs at once, independent of the filter and of the other truths: RK4, one lane a run.

    M theta_ddot = -l cos(theta) [mu (g + z_ddot) + k_p (l sin theta - r) + c_p l cos(theta) theta_dot + c_g z_dot]
                   - c_l theta_dot - k_l (theta - theta_l) - T_f theta_dot / sqrt(theta_dot^2 + v_f^2)
                   + tau_m + disturbance

with M = l^2 (eta^2 m_l + m_p) + J_l, mu = eta m_l + m_p. The arm's spring rests at the height r, which the pilot moves
to move the lever; theta_l stays. All that moves is given at the samples and is linear between them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665
STOP_RATE = 2e-3
"""theta_dot at which friction reaches 71 % of its limit [rad/s]."""


@dataclass(frozen=True)
class Hardware:
    """The lever itself; SI units."""

    length: float = 0.45
    mass: float = 1.2
    mass_position: float = 0.5
    inertia: float = 0.020
    damping: float = 0.5
    stiffness: float = 5.0


@dataclass
class Lanes:
    """What acts on each lever: arrays of shape (samples, lanes), or anything that broadcasts to it."""

    period: float
    """Between samples [s]."""
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
    """Torque that nobody measures [N m]."""
    kick: FloatArray
    """What process noise adds to theta_dot from sample to sample [rad/s]."""
    friction: FloatArray
    """Coulomb friction [N m]."""
    hardware: Hardware = field(default_factory=Hardware)


def _rest_height(lanes: Lanes, m_p: FloatArray, k_p: FloatArray, trim: FloatArray) -> FloatArray:
    """r so that the lever is at rest at `trim` with gravity and the lever's own spring (theta_l: the first trim)."""
    h = lanes.hardware
    weight = (h.mass_position * h.mass + m_p) * GRAVITY
    own = h.stiffness * (trim - lanes.trim[0]) / (h.length * np.cos(trim))
    holds = k_p > 0.0
    rest: FloatArray = np.where(
        holds, h.length * np.sin(trim) + (weight + own) / np.where(holds, k_p, 1.0), 0.0
    )
    return rest


def run(lanes: Lanes) -> tuple[FloatArray, FloatArray]:
    """theta [rad] and theta_dot [rad/s] of every lane at every sample; at the start at rest at the trim."""
    h, period = lanes.hardware, lanes.period
    count, width = lanes.z_ddot.shape
    wide = lambda values: np.broadcast_to(values, (count, width))  # noqa: E731
    m_p, c_p, k_p, trim = (wide(values) for values in (lanes.m_p, lanes.c_p, lanes.k_p, lanes.trim))
    friction = wide(lanes.friction)
    free = m_p <= 0.0  # nobody holds it: a balance spring carries the lever
    mu = h.mass_position * h.mass + m_p
    drive = mu * (lanes.z_ddot + np.where(free, 0.0, GRAVITY)) - k_p * _rest_height(lanes, m_p, k_p, trim)
    inverse = 1.0 / (h.length**2 * (h.mass_position**2 * h.mass + m_p) + h.inertia)
    outer = wide(lanes.tau_m + lanes.disturbance + h.stiffness * trim[0])
    stop, length = STOP_RATE**2, h.length

    def acceleration(i: int, part: float, th: FloatArray, rate: FloatArray) -> FloatArray:
        j = i + 1
        mix = (lambda a: a[i]) if part == 0.0 else (lambda a: a[j]) if part == 1.0 else (lambda a: 0.5 * (a[i] + a[j]))
        cosine = np.cos(th)
        arm = mix(drive) + k_p[i] * length * np.sin(th) + c_p[i] * length * cosine * rate
        other = mix(outer) - h.damping * rate - h.stiffness * th - friction[i] * rate / np.sqrt(rate * rate + stop)
        return (other - length * cosine * arm) * inverse[i]

    theta, theta_dot = np.empty((count, width)), np.empty((count, width))
    x, v = trim[0].copy(), np.zeros(width)
    for i in range(count):
        theta[i], theta_dot[i] = x, v
        if i == count - 1:
            break
        a1 = acceleration(i, 0.0, x, v)
        v2 = v + 0.5 * period * a1
        a2 = acceleration(i, 0.5, x + 0.5 * period * v, v2)
        v3 = v + 0.5 * period * a2
        a3 = acceleration(i, 0.5, x + 0.5 * period * v2, v3)
        v4 = v + period * a3
        a4 = acceleration(i, 1.0, x + period * v3, v4)
        x = x + period / 6.0 * (v + 2.0 * (v2 + v3) + v4)
        v = v + period / 6.0 * (a1 + 2.0 * (a2 + a3) + a4) + lanes.kick[i]
    return theta, theta_dot
