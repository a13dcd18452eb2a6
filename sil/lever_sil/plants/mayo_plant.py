"""Pilots as Mayo (1989) has measured them, by their transfer functions: the truth of the firmware's model "hand".

R. Mayo, "The involuntary participation of a human pilot in a helicopter collective control loop", 15th European
Rotorcraft Forum, Amsterdam 1989, paper 81: absolute acceleration of the hand on the collective over that of the cabin,

    H(s) = (b s + w) / (s^2 + a s + w)          a [1/s]   b [1/s]   w [1/s^2]
    ectomorphic (slight)                         13.70      5.19      452.3
    mesomorphic (sturdy)                         13.31      4.02      555.4

The lever follows the hand. Its motion d relative to the cabin is (H - 1) z, with H - 1 = -(s^2 + (a - b) s) / (...):

    d_ddot = -w d - a d_dot - z_ddot - (a - b) z_dot,       theta = theta_0 + d / (l cos theta_0)

for small motion about the trim. That is a linear system (linear_plant.py) whose base shakes with z_ddot + (a - b)
z_dot: H damps the hand against the air outside as well, so the lever leans as long as the cabin climbs. z_dot is
integrated from 0. Weight, springs and the lever's own inertia are in H already; no motor torque acts. The dynamics are
the poles of H.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from .linear_plant import LinearPlant, LinearTruth, System
from .truth import Block, Conditions


@dataclass(frozen=True)
class Hand:
    """H of a pilot."""

    damping: float
    """a [1/s]"""
    lead: float
    """b [1/s]"""
    stiffness: float
    """w [1/s^2]"""

    @property
    def outside(self) -> float:
        """Return a - b: what damps the hand's motion in space, not that in the cabin [1/s]."""
        return self.damping - self.lead


HANDS: Mapping[str, Hand] = {
    "ectomorphic": Hand(13.70, 5.19, 452.3),
    "mesomorphic": Hand(13.31, 4.02, 555.4),
}
"""By somatotype."""


@dataclass(frozen=True)
class Mayo(LinearTruth):
    """A pilot of one somatotype on a lever of `length` [m]; `trim` [rad] at every sample."""

    model = "hand"
    takes_torque = False
    hand: Hand
    length: float
    trim: FloatArray

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        """k_hand [1/s²], c_hand [1/s] and c_space [1/s], constant over the run."""
        hand, ones = self.hand, np.ones_like(self.trim)
        return {"k_hand": hand.stiffness * ones, "c_hand": hand.damping * ones, "c_space": hand.outside * ones}

    @property
    def system(self) -> System:
        """Coefficients of the hand's motion relative to the cabin, as an angle of the lever."""
        ones = np.ones_like(self.trim)
        gain = -1.0 / (self.length * np.cos(self.trim))
        return System(self.hand.stiffness * ones, self.hand.damping * ones, gain, 0.0 * ones, self.trim)

    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """With z_dot = z_ddot / s: one pole more, at 0."""
        relative = super().transfer(samples)
        numerator = relative.numerator * (1.0, self.hand.outside)
        return Transfer(numerator, np.pad(relative.denominator, ((0, 0), (0, 1))))

    def felt(self, conditions: Conditions) -> Conditions:
        """With z_ddot + (a - b) z_dot in place of z_ddot."""
        z_ddot = conditions.z_ddot
        z_dot = np.zeros_like(z_ddot)
        np.cumsum(0.5 * conditions.period * (z_ddot[1:] + z_ddot[:-1]), out=z_dot[1:])
        return dataclasses.replace(conditions, z_ddot=z_ddot + self.hand.outside * z_dot)

    def body(self, conditions: Conditions) -> LinearPlant:
        """Return the linear system at the first sample, which feels the cabin's velocity, too."""
        return LinearPlant(self.system, _InSpace(**vars(conditions), outside=self.hand.outside))


@dataclass(frozen=True, kw_only=True)
class _InSpace(Conditions):
    """As felt(), but no sooner than z_ddot is known."""

    outside: float

    def blocks(self) -> Iterator[Block]:
        z_dot = 0.0
        for block in super().blocks():
            z_ddot = self.z_ddot[block.periods.start : block.periods.stop + 1]
            gained = 0.5 * self.period * (z_ddot[1:] + z_ddot[:-1])
            speed = np.cumsum(np.append(z_dot, gained))
            z_dot = float(speed[-1])
            yield dataclasses.replace(block, z_ddot=self.middles(z_ddot + self.outside * speed))
