"""The grip force as an output: what the lever's own equation of motion needs of the hand.

    l F = I (θ̇⁺ - θ̇)/dt + c_l θ̇ + k_l (θ - rest) + l η m_l (z̈ + g) cos(trim) - τ_m - d

with the lever's own inertia I, and d the torque that is not modelled: in a step the walk of θ̇ is M dθ̇ = d dt, M the
inertia of lever and arm. In preload trim all are deviations from their levels, so g and the rest are none.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.detrend import Detrend
from lever_cdkf.models.lever import Lever
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.text.units import GRAVITY

from .learning import seconds

BLOCK = 0.038  # [s] of comparison: longer than this
MEMORY = 10.0  # [s] of comparison and mean square
LEAST = 2.0  # [s] of comparison before the force is wrong
TOLERATED = 0.2  # [1] what the lever's own equation may be off
SURE = 2.0  # standard deviations of the comparison
WALK_LEAST = 1e-3  # [1/√s]
OUTAGE = 0.0205  # [s] a signal missing for longer is out
SETTLING = 0.9  # [1] time that a level needs, in periods of the corner


@dataclass
class Means:
    """Of the blocks' impulses [N m s]: of the drive times the hand's, by sensor and by motion; squares."""

    measured: float = 0.0
    expected: float = 0.0
    drive_square: float = 0.0
    difference_square: float = 0.0
    time: float = 0.0


class Grip:
    """The sensor of a lever."""

    def __init__(self, lever: Lever, settings: Mapping[str, float], detrended: bool) -> None:
        self.lever, self.settings, self.detrended = lever, settings, detrended
        self.inertia = float(lever.total_inertia(np.zeros(1))[0])
        self.first_moment = float(lever.unbalance(np.zeros(1))[0])
        self.level: Detrend | None = None
        self.settling, self.missing = seconds(0.0), seconds(0.0)
        self.applied_torque = self.rest = 0.0
        self.raw, self.square = 0.0, 0.0
        self.means = Means()
        self.right = self.wrong = False
        self.rate = 0.0  # θ̇ at the beginning of the block
        self.elapsed, self.counts = 0.0, True  # since then; all blocks of learning in it count
        self.drive = self.alone = self.force = 0.0  # impulses since then, of the second all but the hand's

    def step(
        self, measured: float | None, x: Array, u: tuple[float, ...], errors: Array, trim: float, dt: float
    ) -> tuple[float, Array] | None:
        """Return the force [N] that the filter takes and what a unit of each considered error adds to it by the inputs,
        (k,).

        None where it is missing or not believed. `measured`: of the sample [N]; `x` and the mean inputs `u` as for a
        prediction, `errors` (2, k) of the inputs.
        """
        lever, cosine = self.lever, math.cos(trim)
        self.rest, weight = (0.0, 0.0) if self.detrended else (lever.lever_preload_angle, GRAVITY)
        self.applied_torque = u[1] - self.first_moment * cosine * (u[0] + weight)  # torque on the lever
        self.drive += dt * self.applied_torque
        self.alone += dt * (self.applied_torque - float(self._own(x)))
        self._receive(measured, dt)
        if self.level is None:
            return None
        deviation = self.level.step(self.raw, self.settings["trim_corner"], dt)
        force = deviation if self.detrended else self.raw
        self.force += dt * lever.length * force
        self.square += min(dt / MEMORY, 1.0) * (force**2 - self.square)
        self.settling -= seconds(dt) if self.settling > 0.0 else seconds(0.0)
        if measured is None or not self.right or self.wrong:
            return None
        return force, (self.first_moment * cosine * errors[0] - errors[1]) / lever.length

    def expected(self, before: Array, after: Array, dt: float) -> Array:
        """Return the forces (N,) of states (2, N) before and after the step."""
        needed: Array = self.inertia * (after[1] - before[1]) / dt + self._own(before) - self.applied_torque
        return needed / self.lever.length

    def _own(self, x: Array) -> Array:
        """Return torque of the lever's own damper and spring [N m]."""
        torque: Array = self.lever.damping * x[1] + self.lever.stiffness * (x[0] - self.rest)
        return torque

    def _receive(self, measured: float | None, dt: float) -> None:
        if measured is None:
            self.missing += seconds(dt)
            return
        self.raw = (measured - self.settings["grip_force_bias"]) / self.settings["grip_force_gain"]
        if self.level is None or self.missing > OUTAGE:
            self.level, self.means, self.right = Detrend(self.raw), Means(), False
            self.settling = seconds(SETTLING / self.settings["trim_corner"] if self.detrended else 0.0)
        self.missing = seconds(0.0)

    def noise(self, dt: float) -> float:
        """Return standard deviation of the force. A constant gain error counts as white noise, of the density at
        which walking parameters are as certain as it is."""
        walk = max(self.settings["k_p_walk"], WALK_LEAST)
        density = self.settings["grip_force_gain_sigma"] ** 4 / walk**2
        return math.sqrt(self.settings["grip_force_noise"] ** 2 + self.square * density / dt)

    def begin(self) -> None:
        """Start the level again where it is."""
        if self.level is not None:
            self.level.begin(self.level.level)

    def end_block(self, rate: float, period: float, counts: bool) -> None:
        """Compare sensor and motion, after a block of learning that ends at the rate θ̇."""
        self.elapsed += period
        self.counts = self.counts and counts
        if self.elapsed > BLOCK:
            hand = self.inertia * (rate - self.rate) - self.alone
            if self.counts and self.level is not None and self.settling <= 0.0 and self.missing < OUTAGE:
                self._compare(hand, self.elapsed)
            self.rate, self.drive, self.alone, self.force = rate, 0.0, 0.0, 0.0
            self.elapsed, self.counts = 0.0, True

    def _compare(self, hand: float, period: float) -> None:
        means = self.means
        means.time += period if means.time < MEMORY else 0.0
        share = period / means.time
        means.measured += share * (self.force * self.drive - means.measured)
        means.expected += share * (hand * self.drive - means.expected)
        means.drive_square += share * (self.drive**2 - means.drive_square)
        means.difference_square += share * ((self.force - hand) ** 2 - means.difference_square)
        limit = (2.0 * self.settings["grip_force_gain_sigma"] + TOLERATED) * abs(means.expected)
        off = abs(means.measured - means.expected)
        sure = SURE * math.sqrt(means.drive_square * means.difference_square * share)
        self.right = off + sure < limit
        self.wrong = self.wrong or (off > limit + sure and means.time > LEAST)
