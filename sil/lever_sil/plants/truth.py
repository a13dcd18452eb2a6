"""What every truth has: a pilot with his lever as a run needs them, and how they move from sample to sample.

A new one is a module beside lever_plant.py with the interface of Truth, and its table in pilots.py.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, ClassVar

import numpy as np
from lever_cdkf.models.transfer import Transfer
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

LONGEST_SUBSTEP = 0.25e-3
"""Longest substep of an integration [s]; at 4 Hz the frequency is then right to 3e-6."""

BLOCK = 4096
"""Periods prepared at a time, so that an hour fits into memory."""


@dataclass(frozen=True)
class Dynamics:
    """Lever and arm, linearised about the trim, at every sample."""

    natural_frequency: FloatArray
    """Undamped [Hz]."""
    damping_ratio: FloatArray
    """[1]"""


@dataclass(frozen=True)
class Conditions:
    """What acts on any lever, and how finely its motion is worked out."""

    z_ddot: FloatArray
    """Acceleration of the base without gravity at the samples [m/s^2]; linear between them."""
    period: float
    """Between two samples [s]."""
    process_noise: float
    """Random walk of theta_dot: unmodelled torque [rad/s/sqrt(s)]."""
    motor_lag: float
    """Time constant with which the torque follows its command [s]."""
    rng: np.random.Generator
    substeps: int | None = None
    """In a period; None: as few as LONGEST_SUBSTEP allows."""
    disturbance: FloatArray | float = 0.0
    """Unmeasured torque in the lever, at the samples [N m]; linear between them."""
    ahead: int = BLOCK
    """Periods that are prepared at a time: 1 where z_ddot is known up to the next sample only."""

    @property
    def count(self) -> int:
        """Substeps in a period."""
        return math.ceil(self.period / LONGEST_SUBSTEP - 1e-6) if self.substeps is None else self.substeps

    @property
    def step(self) -> float:
        """Length of a substep [s]."""
        return self.period / self.count

    @property
    def kick(self) -> float:
        """Standard deviation of what process noise adds to theta_dot in a substep [rad/s]."""
        return self.process_noise * math.sqrt(self.step)

    def decay(self, substeps: float) -> float:
        """Return what is left after that many substeps of a difference between torque and command."""
        return math.exp(-substeps * self.step / self.motor_lag) if self.motor_lag > 0.0 else 0.0

    def blocks(self) -> Iterator[Block]:
        """Yield the periods between the samples in order, some thousand at a time."""
        disturbance = np.broadcast_to(self.disturbance, self.z_ddot.shape)
        last = len(self.z_ddot) - 1
        for begin in range(0, last, self.ahead):
            end = min(begin + self.ahead, last)
            yield Block(
                slice(begin, end),
                self.middles(self.z_ddot[begin : end + 1]),
                self.kick * self.rng.standard_normal((end - begin, self.count)),
                self.step * self.middles(disturbance[begin : end + 1]),
            )

    def rows(self, columns: tuple[FloatArray, ...]) -> Iterator[tuple[Any, ...]]:
        """Yield the columns at each period between the samples, and [(z_ddot, kick, push), ...] of its substeps."""
        for block in self.blocks():
            drive = np.stack((block.z_ddot, block.kick, block.push), axis=2).tolist()
            yield from zip(*(column[block.periods].tolist() for column in columns), drive, strict=True)

    def middles(self, signal: FloatArray) -> FloatArray:
        """Return a signal, given at the samples and linear between them, in the middle of each substep."""
        part = (np.arange(self.count) + 0.5) / self.count
        middles: FloatArray = signal[:-1, None] + np.diff(signal)[:, None] * part
        return middles


@dataclass(frozen=True)
class Block:
    """What acts in some periods: arrays of shape (periods, substeps)."""

    periods: slice
    z_ddot: FloatArray
    """Base acceleration in the middle of the substep [m/s^2]."""
    kick: FloatArray
    """What process noise adds to theta_dot [rad/s]."""
    push: FloatArray
    """Impulse of the disturbance [N m s]."""


class Body(ABC):
    """A lever that moves. It starts at rest at `theta`; torque is 0."""

    def __init__(self, theta: float, conditions: Conditions) -> None:
        self.theta = theta
        """[rad]"""
        self.theta_dot = 0.0
        """[rad/s]"""
        self.tau_m = 0.0
        """Motor torque that acts [N m]."""
        self.grip_force = math.nan
        """Of the hand on the lever, across it, positive where it raises theta: mean since the last sample [N]; NaN
        where it is not modelled."""
        self._step = conditions.step
        self._lag_middle, self._lag = conditions.decay(0.5), conditions.decay(1.0)

    @abstractmethod
    def advance(self, command: float) -> None:
        """To the next sample, with the torque `command` [N m] held. Raise StopIteration after the last sample."""


class Truth(ABC):
    """A pilot and his lever over a whole run, at its samples."""

    model: ClassVar[str]
    """Key `model` of [pilot]; a model of the firmware has the same name."""
    takes_torque: ClassVar[bool] = True
    """Whether a torque, of the motor or a disturbance, means something to it."""
    has_grip_force: ClassVar[bool] = False
    """Whether its body knows the force of the hand on the lever."""
    names: ClassVar[tuple[str, ...]] = ()
    """Of the parameters, which are its columns of these names."""

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        """The model's parameters by name, SI units; NaN while the hands are off the lever."""
        return {name: getattr(self, name) for name in self.names}

    @property
    @abstractmethod
    def rest(self) -> FloatArray:
        """The angle at which the lever rests [rad]."""

    @property
    @abstractmethod
    def dynamics(self) -> Dynamics:
        """Return natural frequency and damping ratio; NaN while the hands are off the lever.

        They are those of the mode that an observer of theta sees, where there are several.
        """

    @abstractmethod
    def transfer(self, samples: NDArray[np.intp]) -> Transfer:
        """theta/z_ddot about the rest angle, at these samples."""

    @abstractmethod
    def body(self, conditions: Conditions) -> Body:
        """Return the lever at the first sample."""

    def at(self, samples: slice) -> Truth:
        """Return the same at some of its samples only."""
        part: Truth = _part(self, samples)
        return part


def _part(value: Any, samples: slice) -> Any:
    """Return these samples of every array in a dataclass, and in those that it holds."""
    parts = {}
    for each in fields(value):
        own = getattr(value, each.name)
        if isinstance(own, np.ndarray):
            parts[each.name] = own[samples]
        elif is_dataclass(own):
            parts[each.name] = _part(own, samples)
    return replace(value, **parts)


class ManyModes(Truth):
    """A truth with more than one mode, whose lever rests at the trim."""

    trim: FloatArray

    @property
    def rest(self) -> FloatArray:
        """The trim angle [rad]."""
        return self.trim

    @property
    def dynamics(self) -> Dynamics:
        """Natural frequency [Hz] and damping ratio of the dominant mode.

        They are worked out only where the trim or a parameter has changed: eigenvalues take long.
        """
        columns = np.stack((*self.parameters.values(), self.trim))
        new = np.append(True, np.any(np.diff(columns, axis=1) != 0.0, axis=0))
        frequency, ratio = self.transfer(np.flatnonzero(new)).dominant_mode()
        held = np.cumsum(new) - 1
        return Dynamics(frequency[held], ratio[held])
