"""The linear truths, in double precision: theta moves as a mass on a spring and a damper does.

    theta_ddot = -stiffness (theta - rest) - damping theta_dot + gain z_ddot + compliance tau_m

    linear_physical [m, c, k]           stiffness k/m, damping c/m, gain 1, compliance 1/m
    linear_black_box [a21, a22, b21]    stiffness -a21, damping -a22, gain b21, compliance 0

with the signs of firmware/model/linear_*.c. The lever rests at the trim, a trajectory (preload trim), or at its own
preload angle (preload fixed). Gravity has no part in it.

Integration: as in lever_plant.py, the linearly implicit midpoint rule on the same substeps, with process noise on
theta_dot.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from .truth import Body, Conditions, Dynamics, Truth


@dataclass(frozen=True)
class System:
    """The coefficients of the equation above at every sample: arrays of equal length."""

    stiffness: FloatArray
    """Above 0 [1/s^2]."""
    damping: FloatArray
    """[1/s]"""
    gain: FloatArray
    """[rad/s^2 per m/s^2]"""
    compliance: FloatArray
    """[rad/s^2 per N m]"""
    rest: FloatArray
    """[rad]"""


class LinearTruth(Truth):
    """A truth that is such a system."""

    @property
    @abstractmethod
    def system(self) -> System:
        """Its coefficients."""

    @property
    def rest(self) -> FloatArray:
        """The rest angle of the system [rad]."""
        return self.system.rest

    @property
    def dynamics(self) -> Dynamics:
        """Natural frequency [Hz] and damping ratio of the second-order system."""
        omega = np.sqrt(self.system.stiffness)
        return Dynamics(omega / (2.0 * np.pi), self.system.damping / (2.0 * omega))

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """Return theta/z_ddot: the gain over the monic second-order denominator."""
        system = self.system
        denominator = (np.ones_like(system.damping), system.damping, system.stiffness)
        return Transfer(system.gain[samples, None], np.stack(denominator, axis=1)[samples])

    def body(self, conditions: Conditions) -> LinearPlant:
        """Return the linear system at the first sample."""
        return LinearPlant(self.system, self.felt(conditions))

    def felt(self, conditions: Conditions) -> Conditions:
        """Return the conditions with the base acceleration that drives the system."""
        return conditions


@dataclass(frozen=True)
class Physical(LinearTruth):
    """Mass [kg], damper [N s/m] and spring [N/m] on the base, theta taken for metres and tau_m for newtons."""

    model = "linear_physical"
    names = ("m", "c", "k")
    m: FloatArray
    c: FloatArray
    k: FloatArray
    trim: FloatArray

    @property
    def system(self) -> System:
        """Coefficients of a mass on spring and damper, driven by base and force."""
        return System(self.k / self.m, self.c / self.m, np.ones_like(self.m), 1.0 / self.m, self.trim)


@dataclass(frozen=True)
class BlackBox(LinearTruth):
    """a21 [1/s^2], a22 [1/s] and b21 [1]; no torque acts."""

    model = "linear_black_box"
    takes_torque = False
    names = ("a21", "a22", "b21")
    a21: FloatArray
    a22: FloatArray
    b21: FloatArray
    trim: FloatArray

    @property
    def system(self) -> System:
        """Coefficients of the black box, on which no force acts."""
        return System(-self.a21, -self.a22, self.b21, np.zeros_like(self.b21), self.trim)


class LinearPlant(Body):
    """System and motor: a truth.Body."""

    def __init__(self, system: System, conditions: Conditions) -> None:
        super().__init__(float(system.rest[0]), conditions)
        self._rows = conditions.rows(tuple(vars(system).values()))

    def advance(self, command: float) -> None:
        """To the next sample, with the torque `command` [N m] held. Raise StopIteration after the last sample."""
        theta, theta_dot, torque = self.theta, self.theta_dot, self.tau_m - command
        stiffness, damping, gain, compliance, rest, drive = next(self._rows)
        step, lag_middle, lag = self._step, self._lag_middle, self._lag
        half = 0.5 * step
        for acceleration, kick, push in drive:
            force = gain * acceleration + compliance * (command + torque * lag_middle)
            force -= stiffness * (theta + half * theta_dot - rest) + damping * theta_dot
            change = (step * force + (kick + compliance * push)) / (1.0 + half * damping)
            theta += step * (theta_dot + 0.5 * change)
            theta_dot += change
            torque *= lag
        self.theta, self.theta_dot, self.tau_m = theta, theta_dot, command + torque
