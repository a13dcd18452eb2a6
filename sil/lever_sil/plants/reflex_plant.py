"""A truth that no model of the firmware is: the arm of lever_plant.py, and a stretch reflex that acts late.

The muscle's spindles feel how far and how fast the grip has moved from where the pilot wants it, and a spinal reflex
pulls against it one delay later. With the grip's height y = l (sin theta - sin theta_0), beside all that acts in
lever_plant.py,

    tau_reflex(t) = -l cos(theta(t)) (k_r y(t - T) + c_r y_dot(t - T))

van der Helm, Schouten, de Vlugt and Brouwn (J. Neurosci. Methods 119, 2002) identify an arm that keeps its posture as
such an intrinsic and such a reflexive part; the muscle's own lag, of second order, is left out here. The delay of
a spinal reflex of the arm is 25 to 40 ms. At the 3.5 Hz of an arm on a lever, 35 ms are a phase of 44 degrees: k_r
takes damping away, and c_r gives stiffness.

The torque is held over a sample period at what is right in its middle, from the history at the samples, linear between
them. The transfer function has Pade's approximation of exp(-s T) of order 4 over 4, right to 1e-6 below 10 Hz. The
dynamics are those of its dominant mode.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from . import lever_plant
from .truth import Conditions, ManyModes

DELAY = 0.035
"""T where nothing else is said [s]."""
_ORDER = 4


@dataclass(frozen=True)
class Reflex(ManyModes):
    """The lever, and the pilot at every sample: arrays of equal length [kg, N s/m, N/m, N/m, N s/m, rad]."""

    model = "reflex"
    has_grip_force = True
    names = ("m_p", "c_p", "k_p", "k_r", "c_r")
    lever: lever_plant.Lever
    delay: float
    """[s]"""
    m_p: FloatArray
    c_p: FloatArray
    k_p: FloatArray
    k_r: FloatArray
    c_r: FloatArray
    trim: FloatArray

    @property
    def arm(self) -> lever_plant.LeverTruth:
        """What does not come late."""
        return lever_plant.LeverTruth(self.lever, lever_plant.Truth(self.m_p, self.c_p, self.k_p, self.trim), "trim")

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """N / (D + R exp(-s T)) with N / D of the arm alone and exp(-s T) = P(-s) / P(s)."""
        alone = self.arm.transfer(samples)
        rise = self.lever.lever_length * np.cos(self.trim[samples, None])
        late = rise**2 * np.stack((self.c_r[samples], self.k_r[samples]), axis=1)
        ahead = np.array([_pade(power) * self.delay**power for power in range(_ORDER, -1, -1)])
        behind = ahead * (-1.0) ** np.arange(_ORDER, -1, -1)
        denominator = _times(alone.denominator, ahead)
        denominator[:, 1:] += _times(late, behind)
        return Transfer(_times(alone.numerator, ahead), denominator)

    def body(self, conditions: Conditions) -> ReflexPlant:
        """Return the lever at the first sample, at rest at its trim angle."""
        return ReflexPlant(self, conditions)


def _pade(power: int) -> float:
    """Return coefficient of (s T)^power in the denominator of Pade's approximation of exp(-s T)."""
    factorial = math.factorial
    whole = factorial(2 * _ORDER) * factorial(power) * factorial(_ORDER - power)
    return factorial(2 * _ORDER - power) * factorial(_ORDER) / whole


def _times(polynomials: FloatArray, polynomial: FloatArray) -> FloatArray:
    return np.stack([np.convolve(row, polynomial) for row in polynomials])


def coefficients(truth: Reflex) -> tuple[FloatArray, ...]:
    """At every sample, beside those of the arm: k_r, c_r, sin theta_0."""
    return truth.k_r, truth.c_r, np.sin(truth.trim)


def late(truth: Reflex, period: float) -> float:
    """Return the delay after the middle of a sample period, in such periods."""
    return truth.delay / period - 0.5


class ReflexPlant(lever_plant.LeverPlant):
    """Lever, arm with reflex and motor: a truth.Body."""

    def __init__(self, truth: Reflex, conditions: Conditions) -> None:
        super().__init__(truth.lever, truth.arm.pilot, "trim", conditions)
        self._grip = np.stack(coefficients(truth), axis=1)
        self._middle = 0.5 * conditions.period
        self._late = late(truth, conditions.period)
        self._forces: list[float] = []

    def advance(self, command: float, reflex: float = 0.0) -> None:
        """Go to the next sample, with the torques `command` and `reflex` [N m], beside its own, held.

        Raise StopIteration after the last sample.
        """
        length = self._lever.lever_length
        k_r, c_r, rest_sine = self._grip[len(self._forces)].tolist()
        height = length * (math.sin(self.theta) - rest_sine)
        self._forces.append(k_r * height + c_r * length * math.cos(self.theta) * self.theta_dot)
        at = max(len(self._forces) - 1 - self._late, 0.0)
        before = int(at)
        force = self._forces[before]
        if at > before:
            force += (at - before) * (self._forces[before + 1] - force)
        leverage = length * math.cos(self.theta + self._middle * self.theta_dot)
        super().advance(command, reflex - leverage * force)
