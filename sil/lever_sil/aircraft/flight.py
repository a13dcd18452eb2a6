"""A helicopter in the loop with a lever, sample by sample.

The airframe is linear and stepped exactly for pitch and gust that are linear over a substep (first-order hold). The
actuator, which has limits, is stepped exactly for a command that is constant over it. The delay is at least a sample
period, so that the acceleration up to the next sample follows from lever angles that are known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from .aircraft import Aircraft, Coupled

LONGEST_SUBSTEP = 1e-3
"""[s]; at 4 Hz the first-order hold of the pitch is then right to 5e-5."""


class Flight:
    """Starts in hover, trimmed. All angles are deviations from the trim."""

    def __init__(self, coupled: Coupled, period: float, gust: FloatArray) -> None:
        """Start at the first sample; samples are `period` [s] apart, no more than the aircraft's delay.

        `gust`: vertical force over mass [m/s^2] at the samples.
        """
        self.constants = constants = Constants.of(coupled.aircraft, period)
        self.gearing, self.gust = coupled.gearing, gust
        self._force = gust.tolist()
        self._state, self._pitch = [0.0] * len(constants.step), 0.0
        self._correction: list[float] = []
        self._lever: list[float] = []
        self.z_ddot, self.sensed = self._outputs(0)
        """At this sample, at the pilot's seat and at the accelerometer [m/s^2]."""

    def advance(self, delta: float, correction: float = 0.0) -> float:
        """Go on to the next sample; return z_ddot at the seat there [m/s^2].

        `delta`: angle of the lever about its trim at this sample [rad]; `correction`: what is put out now to be added
        to that angle [rad], which takes a sample period and the aircraft's correction_delay.
        """
        now, constants = len(self._lever), self.constants
        late = constants.correction_delay
        self._correction.append(correction)
        angle = delta + (self._correction[now - late] if now >= late else 0.0)
        if constants.passed < 1.0:
            last = self._lever[-1] if now else 0.0
            angle = last + constants.passed * (angle - last)
        self._lever.append(angle)
        gust, rise = self._force[now], self._force[now + 1] - self._force[now]
        for substep in range(constants.substeps):
            begin, end = substep / constants.substeps, (substep + 1.0) / constants.substeps
            before = self._pitch
            command = self.gearing * self._delayed(now + 0.5 * (begin + end) - constants.delay)
            change = limited(constants.approach * (command - before), constants.most_change)
            self._pitch = limited(before + change, constants.travel)
            ends = (*self._state, before, gust + begin * rise, self._pitch, gust + end * rise)
            self._state = [dot(row, ends) for row in constants.step]
        self.z_ddot, self.sensed = self._outputs(now + 1)
        return self.z_ddot

    def _outputs(self, sample: int) -> tuple[float, float]:
        given = (*self._state, self._pitch, self._force[sample])
        seat, sensor = (dot(row, given) for row in self.constants.output)
        return seat, sensor

    def _delayed(self, time: float) -> float:
        """Return the corrected angle of the lever at `time` [samples], which is past; 0 before the start."""
        if time < 0.0:
            return 0.0
        whole = int(time)
        return self._lever[whole] + (time - whole) * (self._lever[whole + 1] - self._lever[whole])


@dataclass(frozen=True)
class Constants:
    """What advances an aircraft by a substep; fast/c/aircraft.h takes the same."""

    substeps: int
    """In a sample period."""
    step: list[list[float]]
    """(n, n + 4): of the state, pitch and gust where it begins, and those where it ends."""
    output: list[list[float]]
    """(2, n + 2): z_ddot at seat and accelerometer of state, pitch and gust."""
    approach: float
    """Share of its way that the actuator goes, without limits."""
    most_change: float
    """Of the pitch [rad]."""
    travel: float
    """[rad]"""
    delay: float
    """[sample periods]"""
    passed: float
    """Of a change of the lever's angle, in a sample period [1]."""
    correction_delay: int
    """Until a correction is added to the lever's angle [sample periods]."""

    @classmethod
    def of(cls, aircraft: Aircraft, period: float) -> Constants:
        """Return the constants of an aircraft for a sample period [s], discretised by first-order hold."""
        substeps = math.ceil(period / LONGEST_SUBSTEP - 1e-6)
        step = period / substeps
        airframe, lag = aircraft.airframe(), math.exp(-step * 2.0 * math.pi * aircraft.actuator_bandwidth)
        return cls(
            substeps,
            np.hstack(first_order_hold(airframe.a, airframe.b, step)).tolist(),
            np.hstack((airframe.c, airframe.d)).tolist(),
            1.0 - lag if aircraft.has_actuator else 1.0,
            aircraft.actuator_rate * step,
            aircraft.actuator_travel,
            aircraft.delay / period,
            1.0 - math.exp(-period * 2.0 * math.pi * aircraft.lever_low_pass) if aircraft.lever_low_pass else 1.0,
            1 + round(aircraft.correction_delay / period),
        )


def dot(row: Sequence[float], values: Sequence[float]) -> float:
    """Return the inner product, summed in order, as C does."""
    total = 0.0
    for factor, value in zip(row, values, strict=True):
        total += factor * value
    return total


def limited(value: float, most: float) -> float:
    """Within -most and most."""
    return min(max(value, -most), most)


def first_order_hold(a: FloatArray, b: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return matrices of x and of the input at both ends of a step [s], over which the input is linear.

    They are the exponential of [[A, B, 0], [0, 0, 1/step], [0, 0, 0]] (van Loan 1978), by its series of a part of the
    step, squared.
    """
    n, m = b.shape
    whole = np.zeros((n + 2 * m, n + 2 * m))
    whole[:n, :n], whole[:n, n : n + m] = a, b
    whole[n : n + m, n + m :] = np.eye(m) / step
    squarings = max(0, math.ceil(math.log2(max(1.0, 0.25 * step * float(np.linalg.norm(whole, np.inf))))))
    part = step / 2.0**squarings
    term = total = np.eye(len(whole))
    for order in range(1, 20):
        term = term @ whole * (part / order)
        total = total + term
    for _ in range(squarings):
        total = total @ total
    ramp = total[:n, n + m :]
    return total[:n, :n], total[:n, n : n + m] - ramp, ramp
