"""A truth that no model of the firmware is: an arm with structural (hysteretic) damping in place of a damper.

Soft tissue loses the same share of the energy of a cycle at every frequency (structural damping law: Fredberg and
Stamenovic, J. Appl. Physiol. 67, 1989), where a damper loses more the faster it moves. The only causal stiffness whose
loss factor Im / Re is constant is a power of s. On the grip's height y = l (sin theta - sin theta_0) acts, in place of
k_p and c_p of lever_plant.py,

    F(s) = k_p / cos(a pi / 2) (s / w)^a y(s),     tan(a pi / 2) = loss factor,     w = 2 pi 4 Hz

so that k_p is the stiffness at 4 Hz, in the middle of collective bounce, and k_p times the loss factor is what resists
there. At lower frequencies the arm is softer. The power is a sum of Maxwell elements (a spring and a damper in series):
by sin(a pi) / pi times the integral of x^(a-1) s / (s + x) dx over x > 0, whose part below the slowest element is a
spring, above the fastest a damper.

Integration as in lever_plant.py; the force of an element decays exactly in a substep, at the rate in its middle. The
dynamics are those of the dominant mode of theta/z_ddot.
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

REFERENCE = 4.0
"""Where k_p is the stiffness [Hz]."""
_RATES = 2.0 * math.pi * np.geomspace(0.01, 300.0, 10)
"""Of the elements, two a decade [1/s]: between 0.2 and 30 Hz the loss factor is right to 1 %."""


@dataclass(frozen=True)
class Power:
    """s^a as spring + damper s + sum of springs[i] s / (s + _RATES[i]), normalised: stiffness 1 at REFERENCE."""

    spring: float
    damper: float
    """[s]"""
    springs: FloatArray

    @classmethod
    def of(cls, loss_factor: float) -> Power:
        """Return the one with this loss factor."""
        power = 2.0 / math.pi * math.atan(loss_factor)
        width = math.log(_RATES[1] / _RATES[0])
        scale = math.sin(power * math.pi) / math.pi / math.cos(0.5 * power * math.pi)
        scale /= (2.0 * math.pi * REFERENCE) ** power
        lowest, highest = _RATES[0] * math.exp(-0.5 * width), _RATES[-1] * math.exp(0.5 * width)
        return cls(
            scale * lowest**power / power,
            scale * highest ** (power - 1.0) / (1.0 - power),
            scale * width * _RATES**power,
        )


@dataclass(frozen=True)
class Hysteretic(ManyModes):
    """The lever, and the pilot at every sample: arrays of equal length [kg, N/m at 4 Hz, rad]."""

    model = "hysteretic"
    names = ("m_p", "k_p")
    lever: lever_plant.Lever
    loss_factor: float
    """[1]"""
    m_p: FloatArray
    k_p: FloatArray
    trim: FloatArray

    @property
    def arm(self) -> lever_plant.Truth:
        """The spring and the damper without the elements."""
        power = Power.of(self.loss_factor)
        return lever_plant.Truth(self.m_p, power.damper * self.k_p, power.spring * self.k_p, self.trim)

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """Return that of the spring and the damper, with the elements in its denominator."""
        alone = lever_plant.LeverTruth(self.lever, self.arm, "trim").transfer(samples)
        gain = self.k_p[samples, None] * (self.lever.lever_length * np.cos(self.trim[samples, None])) ** 2
        every = np.poly(-_RATES)
        elements = np.zeros(len(_RATES) + 1)
        for i, spring in enumerate(Power.of(self.loss_factor).springs):
            elements[:-1] += spring * np.poly(-np.delete(_RATES, i))
        denominator = np.stack([np.convolve(row, every) for row in alone.denominator])
        denominator[:, 2:] += gain * elements
        return Transfer(alone.numerator * every, denominator)

    def body(self, conditions: Conditions) -> HystereticPlant:
        """Return the lever at the first sample, at rest at its trim angle."""
        return HystereticPlant(self, conditions)


def coefficients(truth: Hysteretic) -> tuple[FloatArray, ...]:
    """At every sample: M, l mu, k_p, sin theta_0, theta_0."""
    mass, moment = lever_plant.inertia(truth.lever, truth.arm), lever_plant.moment(truth.lever, truth.arm)
    return mass, moment, truth.k_p, np.sin(truth.trim), truth.trim


@dataclass(frozen=True)
class Elements:
    """The Maxwell elements over a substep."""

    until_middle: FloatArray
    """What is left of their forces until its middle."""
    decay: FloatArray
    """And until its end."""
    stretched: FloatArray
    """Force that a rate of 1 m/s brings until then [s]."""
    damper: float
    """Of the arm and of them, until its middle [s]."""

    @classmethod
    def of(cls, power: Power, step: float) -> Elements:
        """For a substep of that length [s]."""
        until_middle, decay = np.exp(-0.5 * step * _RATES), np.exp(-step * _RATES)
        damper = power.damper + float(np.sum(power.springs * (1.0 - until_middle) / _RATES))
        return cls(until_middle, decay, power.springs * (1.0 - decay) / _RATES, damper)


class HystereticPlant(Body):
    """Lever, arm and motor: a truth.Body."""

    def __init__(self, truth: Hysteretic, conditions: Conditions) -> None:
        super().__init__(float(truth.trim[0]), conditions)
        self._lever, self._power = truth.lever, Power.of(truth.loss_factor)
        self._forces = np.zeros(len(_RATES))  # of the elements, for a stiffness of 1 [m]
        self._rest_sine = math.sin(self.theta)
        self._elements = Elements.of(self._power, self._step)
        self._rows = conditions.rows(coefficients(truth))

    def advance(self, command: float) -> None:
        """To the next sample, with the torque `command` [N m] held. Raise StopIteration after the last sample."""
        theta, theta_dot, torque = self.theta, self.theta_dot, self.tau_m - command
        mass, moment, k_p, rest_sine, rest, drive = next(self._rows)
        lever, step, power = self._lever, self._step, self._power
        length, half = lever.lever_length, 0.5 * step
        forces = self._forces - power.springs * (length * (rest_sine - self._rest_sine))
        elements = self._elements
        for acceleration, kick, push in drive:
            middle = theta + half * theta_dot
            rise = length * math.cos(middle)
            resisting, slope = lever_plant.resistance(lever, theta_dot)
            arm = power.spring * length * (math.sin(middle) - rest_sine) + float(elements.until_middle @ forces)
            arm += elements.damper * rise * theta_dot
            force = command + torque * self._lag_middle - rise / length * moment * acceleration - rise * k_p * arm
            force -= lever.lever_stiffness * (middle - rest) + resisting
            impulse = mass * kick + push
            change = (step * force + impulse) / (mass + half * (k_p * elements.damper * rise * rise + slope))
            forces = elements.decay * forces + elements.stretched * (rise * (theta_dot + 0.5 * change))
            theta += step * (theta_dot + 0.5 * change)
            theta_dot += change
            torque *= self._lag
        self._forces, self._rest_sine = forces, rest_sine
        self.theta, self.theta_dot, self.tau_m = theta, theta_dot, command + torque
