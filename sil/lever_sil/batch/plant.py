"""Levers and pilots of many runs at once, independent of the filter and of the other truths: RK4, one lane a run.

    M theta_ddot = -l cos(theta) [mu (g + z_ddot) + k_p (l sin theta - r) + c_p l cos(theta) theta_dot]
                   - c_l theta_dot - k_l (theta - theta_l) + tau_m + disturbance - T_f sign(theta_dot)

with M = l^2 (eta^2 m_l + m_p) + J_l, mu = eta m_l + m_p. The arm's spring rests at the height r, which the pilot moves
to move the lever: where the lever rests at the trim, so that the weight mu g drops out. A lever that nobody holds
(m_p, c_p, k_p = 0) is balanced. theta_l stays. Inputs are given at the samples and are linear between them; the pilot's
m_p, c_p, k_p and the friction are held. Friction acts after each step, as an impulse of at most T_f times the period: a
lever that it stops is held by it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..fast.library import Struct, lib

TICK = 10_000
"""Samples between two signs of life."""


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
        """Return mu [kg]."""
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
        """Return the rows of an array at these samples."""
        values: FloatArray = getattr(self, name)
        return values[samples if len(values) > 1 else np.zeros_like(samples)]

    def only(self, lane: int) -> Lanes:
        """Return one of them."""
        columns = {each.name: getattr(self, each.name) for each in fields(self)}
        own: dict[str, Any] = {name: of[:, [lane]] for name, of in columns.items() if isinstance(of, np.ndarray)}
        return replace(self, **own)


def beside(parts: list[Lanes]) -> Lanes:
    """Return the lanes of all, side by side; period and hardware are those of the first."""
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


class BatchPlant:
    """Levers in motion, by fast/c/lanes.h.

    `theta` [rad] and `theta_dot` [rad/s] are those of each lane at the samples so far, at the first at rest at the
    trim.
    """

    def __init__(self, lanes: Lanes) -> None:
        h, trim = lanes.hardware, lanes.trim
        self.count, self.width = lanes.z_ddot.shape
        self.theta, self.theta_dot = np.zeros(lanes.z_ddot.shape), np.zeros(lanes.z_ddot.shape)
        self.theta[0] = trim[0]
        self.struct = Struct("lanes_t")
        spring = lanes.k_p * h.length
        rest = spring * np.sin(lanes.trim) + h.stiffness * (lanes.trim - lanes.trim[0]) / (
            h.length * np.cos(lanes.trim)
        )
        given = self.struct.pointer
        given.count, given.width, given.period = self.count, self.width, lanes.period
        given.length, given.damping, given.stiffness = h.length, h.damping, h.stiffness
        for name, values in {
            "drive": h.forcing_mass(lanes.m_p) * lanes.z_ddot,
            "torque": lanes.tau_m + lanes.disturbance + h.stiffness * trim[0],
            "rest": np.where(lanes.k_p > 0.0, rest, 0.0),
            "spring": spring,
            "damper": lanes.c_p * h.length,
            "inverse": 1.0 / h.moving_inertia(lanes.m_p),
            "friction": lanes.friction,
            "kick": lanes.kick,
        }.items():
            setattr(given, name, self.column(values))
        given.theta, given.theta_dot = self.struct.doubles(self.theta), self.struct.doubles(self.theta_dot)

    def column(self, values: FloatArray) -> dict[str, Any]:
        """Return values (samples, lanes), or (1, lanes), for C."""
        wide = np.broadcast_to(values, (len(values), self.width))
        return {"value": self.struct.doubles(wide), "step": self.width if len(values) > 1 else 0}

    def move(self, first: int, last: int) -> None:
        """From sample `first` to sample `last`."""
        lib.lanes_move(self.struct.pointer, first, last)


def grip_force(lanes: Lanes, theta: FloatArray, theta_dot: FloatArray) -> FloatArray:
    """Return what the arm does to the lever, mean since the last sample [N].

    Of its weight, which the rest angle balances, it is nothing. Process noise and disturbance act on the lever.
    """

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
    """Return theta [rad] and theta_dot [rad/s] of every lane at every sample; call `tick` now and then."""
    plant = BatchPlant(lanes)
    for first in range(0, plant.count - 1, TICK):
        plant.move(first, min(first + TICK, plant.count - 1))
        tick()
    return plant.theta, plant.theta_dot
