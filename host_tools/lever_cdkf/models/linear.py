"""The linear models, in float64: a mass with spring and damper on a base, a black box, and a hand.

    physical    x_ddot = -(k/m) x - (c/m) x_dot + z_ddot + f/m      p = [m kg, c N s/m, k N/m], all positive
    black box   x_ddot = a21 x + a22 x_dot + b21 z_ddot             p = [a21 1/s², a22 1/s, b21], of any sign

x is what the samples carry as theta, counted from the trim (preload trim) or from where the lever's spring rests
(preload fixed); f is what they carry as motor torque, which the black box does not take.

    hand        d_ddot = -k d - c d_dot - z_ddot - c_space z_dot + f_d     p = [k 1/s², c 1/s, c_space 1/s], positive

d is the motion of the hand in the cabin per unit of its mass, and x = d / (l cos(trim)) that of the lever. All have the
interface of `lever.Lever`: `step` and `dynamics`.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..numeric.arrays import Array
from .lever import Lever

Inputs = tuple[float | Array, ...]
"""z̈ and f, between the samples; for the hand also ż."""

COSINE_LEAST = 0.2  # of the trim


@dataclass(frozen=True)
class Linear(ABC):
    """x_ddot = drive - stiffness x - damping x_dot, with coefficients that a subclass makes of its parameters."""

    rest: float = 0.0
    """Where x is 0 with preload fixed [rad]."""
    preload: str = "trim"

    @classmethod
    def from_settings(cls, settings: Mapping[str, float], preload: str) -> "Linear":
        """Return the model of firmware/lever_settings.def."""
        if preload not in ("fixed", "trim"):
            raise ValueError(f'preload: "{preload}" is neither "fixed" nor "trim"')
        return cls(settings["lever_preload_angle"], preload)

    @abstractmethod
    def coefficients(self, p: Array, u: Inputs) -> tuple[Array, Array, Array]:
        """Return stiffness [1/s²], damping [1/s] and drive, per unit of mass, of parameters (3, …)."""

    def step(self, x: Array, p: Array, u: Inputs, trim: float | Array, dt: float) -> Array:
        """Return the states dt [s] later under constant inputs, by the linearly implicit midpoint rule.

        x (2, …) and p (3, …) broadcast against each other. Second order in dt; no damping is too large.
        """
        theta, rate = x
        stiffness, damping, drive = self.coefficients(p, u)
        middle = theta + 0.5 * dt * rate - (trim if self.preload == "trim" else self.rest)
        change = dt * (drive - stiffness * middle - damping * rate) / (1.0 + 0.5 * dt * damping)
        return np.array((theta + dt * (rate + 0.5 * change), rate + change))

    def dynamics(self, p: Array, trim: float | Array) -> Array:
        """Return natural frequency [Hz] and damping ratio [1] of parameters (3, …), shape (2, …).

        They are the same about any trim.

        Without a restoring stiffness there is neither, and both are 0.
        """
        stiffness, damping, _ = self.coefficients(p, (0.0, 0.0))
        omega = np.sqrt(np.maximum(stiffness, 0.0))
        ratio = np.divide(0.5 * damping, omega, out=np.zeros_like(omega), where=omega > 0.0)
        return np.array((omega / (2.0 * np.pi), ratio))


class LinearPhysical(Linear):
    """Mass, damper and spring on an accelerated base."""

    def coefficients(self, p: Array, u: Inputs) -> tuple[Array, Array, Array]:
        """Return stiffness k [1/s²], damping c [1/s] and drive [rad/s²] of x¨ + c x˙ + k x = drive."""
        m, c, k = p
        return k / m, c / m, u[0] + u[1] / m


class LinearBlackBox(Linear):
    """A second-order system in controllable form."""

    def coefficients(self, p: Array, u: Inputs) -> tuple[Array, Array, Array]:
        """Return stiffness k [1/s²], damping c [1/s] and drive [rad/s²] of x¨ + c x˙ + k x = drive."""
        a21, a22, b21 = p
        return -a21, -a22, b21 * u[0]


@dataclass(frozen=True)
class Hand(Linear):
    """A hand that is damped against the cabin and against space, on a lever of known length and inertia with it."""

    length: float = 1.0  # l [m]
    inertia: float = 1.0  # of lever and hand [kg m²]

    @classmethod
    def from_settings(cls, settings: Mapping[str, float], preload: str) -> "Hand":
        """Take the first guess of m_p as the mass of the hand."""
        lever = Lever.from_settings(settings, preload)
        inertia = float(lever.total_inertia(np.array(settings["m_p"])))
        return cls(settings["lever_preload_angle"], preload, lever.length, inertia)

    def step(self, x: Array, p: Array, u: Inputs, trim: float | Array, dt: float) -> Array:
        """Return the state [rad, rad/s] after dt [s]."""
        of_d = -1.0 / (self.length * np.maximum(np.cos(trim), COSINE_LEAST))
        return super().step(x, p, (of_d * u[0] + u[1] / self.inertia, of_d * u[2]), trim, dt)

    def coefficients(self, p: Array, u: Inputs) -> tuple[Array, Array, Array]:
        """Return stiffness k [1/s²], damping c [1/s] and drive [rad/s²] of x¨ + c x˙ + k x = drive."""
        k, c, c_space = p
        return k, c, u[0] + c_space * u[1]
