"""A helicopter in the loop with a lever, sample by sample.

The airframe is linear and stepped exactly for pitch and gust that are linear over a substep (first-order hold). The
actuator, which has limits, is stepped exactly for a command that is constant over it. The delay is at least a sample
period, so that the acceleration up to the next sample follows from lever angles that are known.
"""

from __future__ import annotations

import math

import numpy as np
from lever_cdkf.host_tools.arrays import FloatArray

from .aircraft import Coupled

LONGEST_SUBSTEP = 1e-3
"""[s]; at 4 Hz the first-order hold of the pitch is then right to 5e-5."""


class Flight:
    """Starts in hover, trimmed. All angles are deviations from the trim."""

    def __init__(self, coupled: Coupled, period: float, gust: FloatArray) -> None:
        """`gust`: vertical force over mass [m/s^2] at the samples, which are `period` [s] apart, no more than the
        aircraft's delay."""
        aircraft = coupled.aircraft
        self._count = math.ceil(period / LONGEST_SUBSTEP - 1e-6)
        step = period / self._count
        self._transition, self._begin, self._end = first_order_hold(*aircraft.matrices()[:2], step)
        self._output, self._feedthrough = (matrix[0] for matrix in aircraft.matrices()[2:])
        self._approach = 1.0 - math.exp(-step * 2.0 * math.pi * aircraft.actuator_bandwidth)
        self._most, self._travel = aircraft.actuator_rate * step, aircraft.actuator_travel
        self._gearing, self._delay, self._gust = coupled.gearing, aircraft.delay / period, gust
        self._state, self._pitch = np.zeros(len(self._transition)), 0.0
        self._lever = [0.0]
        self.z_ddot = float(self._feedthrough @ (0.0, gust[0]))
        """Of the cabin at this sample [m/s^2]."""

    def advance(self, delta: float) -> float:
        """z_ddot at the next sample [m/s^2]; `delta`: angle of the lever, less what corrects it, at this one [rad]."""
        now = len(self._lever) - 1
        self._lever[now] = delta
        for substep in range(self._count):
            part = np.array((substep, substep + 1)) / self._count
            gust = self._gust[now] + part * (self._gust[now + 1] - self._gust[now])
            before = self._pitch
            command = self._gearing * self._delayed(now + float(part.mean()) - self._delay)
            change = self._approach * (command - before)
            pitch = before + min(max(change, -self._most), self._most)
            self._pitch = min(max(pitch, -self._travel), self._travel)
            self._state = (
                self._transition @ self._state + self._begin @ (before, gust[0]) + self._end @ (self._pitch, gust[1])
            )
        self._lever.append(delta)
        self.z_ddot = float(self._output @ self._state + self._feedthrough @ (self._pitch, self._gust[now + 1]))
        return self.z_ddot

    def _delayed(self, time: float) -> float:
        """The lever's angle at `time` [samples], which is past; 0 before the start."""
        if time <= 0.0:
            return self._lever[0] if time == 0.0 else 0.0
        whole = int(time)
        return self._lever[whole] + (time - whole) * (self._lever[whole + 1] - self._lever[whole])


def first_order_hold(a: FloatArray, b: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Matrices of x and of the input at both ends of a step [s], over which the input is linear: the exponential of
    [[A, B, 0], [0, 0, 1/step], [0, 0, 0]] (van Loan 1978), by its series, which converges at once for a short step."""
    n, m = b.shape
    whole = np.zeros((n + 2 * m, n + 2 * m))
    whole[:n, :n], whole[:n, n : n + m] = a, b
    whole[n : n + m, n + m :] = np.eye(m) / step
    term = total = np.eye(len(whole))
    for order in range(1, 20):
        term = term @ whole * (step / order)
        total = total + term
    ramp = total[:n, n + m :]
    return total[:n, :n], total[:n, n : n + m] - ramp, ramp
