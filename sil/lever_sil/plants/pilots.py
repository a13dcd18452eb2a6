"""The table [pilot] of a scenario: a dataclass for each model of the truth, chosen by the key `model`."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from ..toml_tables import choice, item, quantity, read_kind, read_table, tables
from . import hysteretic_plant, lever_plant, linear_plant, mayo_plant, reflex_plant, two_dof_plant
from .lever_plant import Lever, Preload
from .trajectories import Constant, Trajectory, read_trajectory
from .truth import Truth
from .window import Window

Values = Mapping[str, FloatArray]
"""Parameters by name, a value a sample."""

_SIDES = {1: "falls to {least:g}; it must stay above 0", -1: "rises to {greatest:g}; it must stay below 0"}


@dataclass(frozen=True, kw_only=True)
class Pilot(ABC):
    """What all pilots have. A parameter is a field of the name that `signs` gives it."""

    model: ClassVar[str]
    """Key `model` of the table."""
    about: ClassVar[str]
    """What a reader of the report is told that it is."""
    about_dynamics: ClassVar[str] = ""
    """What its true natural frequency is, where it has more than one mode or none of its own."""
    signs: ClassVar[Mapping[str, int]]
    """The parameters: 1 for one that must stay above 0, -1 below 0, 0 for either."""

    trim: Trajectory | None = item(read_trajectory(), "rad", None)
    preload: Preload = choice("trim", "fixed", default="trim")
    process_noise: float = quantity("rad/s/sqrt(s)", 0.05, least=0.0)

    def __post_init__(self) -> None:
        if self.preload == "trim" and self.trim is None:
            raise ValueError("key 'trim' is missing, the angle at which the pilot lets the lever rest")
        if self.preload == "fixed" and self.trim is not None:
            raise ValueError("'trim' goes with preload trim; with fixed preload the lever rests where torques balance")

    def trajectories(self) -> Mapping[str, Trajectory]:
        """Return how the parameters go, by name."""
        return {name: getattr(self, name) for name in self.signs}

    def changes(self) -> set[float]:
        """Return times [s] at which they jump."""
        return {time for trajectory in self.trajectories().values() for time in trajectory.changes()}

    def truth(self, time: FloatArray, stream: Callable[[str], np.random.Generator], lever: Lever) -> Truth:
        """Return the pilot on `lever` at the times [s]; `stream` gives the random numbers of a parameter.

        Raise ValueError for a parameter that loses its sign, or a trim beyond the vertical.
        """
        values = {name: each.values(time, stream(name)) for name, each in self.trajectories().items()}
        for name, sign in self.signs.items():
            if sign and not (sign * values[name]).min() > 0.0:
                side = _SIDES[sign].format(least=values[name].min(), greatest=values[name].max())
                raise ValueError(f"{name}: {side}")
        if self.trim is None:
            trim = np.full_like(time, lever.lever_preload_angle)
        else:
            trim = self.trim.values(time, stream("trim"))
            if not np.abs(trim).max() < 0.5 * math.pi:
                raise ValueError(f"trim: moves by {np.degrees(np.abs(trim).max()):.0f} deg; it must stay below 90 deg")
        return self.build(time, values, trim, lever)

    @abstractmethod
    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return the truth with these parameters and trim angles at the times [s]."""


@dataclass(frozen=True, kw_only=True)
class ArmPilot(Pilot):
    """Mass, damper and spring at the lever's end."""

    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "c_p": 1, "k_p": 1}
    m_p: Trajectory = item(read_trajectory(), "kg")
    c_p: Trajectory = item(read_trajectory(), "N s/m")
    k_p: Trajectory = item(read_trajectory(), "N/m")


@dataclass(frozen=True, kw_only=True)
class HandsOff(Window):
    """Nobody holds the lever."""

    start: float = quantity("s", above=0.0)


def is_held(hands_off: Sequence[HandsOff], time: FloatArray) -> BoolArray:
    """Return whether somebody holds the lever at each of the times `time` [s]; `hands_off` has at least one item."""
    held: BoolArray = np.all([~off.contains(time) for off in hands_off], axis=0)
    return held


@dataclass(frozen=True, kw_only=True)
class LeverPilot(ArmPilot):
    """The arm of firmware/THEORY.md on the lever."""

    model = "lever"
    about = "a rigid lever with the arm as mass, damper and spring at its end"
    hands_off: tuple[HandsOff, ...] = tables(read_table(HandsOff))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hands_off and self.preload == "fixed":
            raise ValueError("'hands_off' goes with preload trim; with fixed preload the lever would fall")

    def changes(self) -> set[float]:
        """Return times [s] of jumps, including those at which the hands leave and take the lever."""
        return super().changes() | {time for off in self.hands_off for time in (off.start, off.end)}

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Where he lets go, the lever's spring keeps its place until he takes it again."""
        if not self.hands_off:
            return lever_plant.LeverTruth(lever, lever_plant.Truth(**values, trim=trim), self.preload)
        held = is_held(self.hands_off, time)
        last_held = np.maximum.accumulate(np.where(held, np.arange(len(time)), 0))
        arm = {name: np.where(held, column, 0.0) for name, column in values.items()}
        return lever_plant.LeverTruth(lever, lever_plant.Truth(**arm, trim=trim[last_held]), self.preload)


@dataclass(frozen=True, kw_only=True)
class PhysicalPilot(Pilot):
    """Mass, damper and spring."""

    model = "linear_physical"
    about = "a mass on a spring and a damper"
    signs: ClassVar[Mapping[str, int]] = {"m": 1, "c": 1, "k": 1}
    m: Trajectory = item(read_trajectory(), "kg")
    c: Trajectory = item(read_trajectory(), "N s/m")
    k: Trajectory = item(read_trajectory(), "N/m")

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return a mass on spring and damper."""
        return linear_plant.Physical(**values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class BlackBoxPilot(Pilot):
    """A second-order system, restoring and damped."""

    model = "linear_black_box"
    about = "a linear second-order system"
    signs: ClassVar[Mapping[str, int]] = {"a21": -1, "a22": -1, "b21": 0}
    a21: Trajectory = item(read_trajectory(), "1/s^2")
    a22: Trajectory = item(read_trajectory(), "1/s")
    b21: Trajectory = item(read_trajectory(), "1")

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return a black box of second order."""
        return linear_plant.BlackBox(**values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class TwoDofPilot(ArmPilot):
    """The arm hangs on a trunk that gives way on its seat."""

    model = "two_dof"
    about = "the arm hangs on a trunk that gives way on its seat, so that two masses swing"
    about_dynamics = "The truth is the one of its two modes that answers more between 2 and 8 Hz."
    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "c_p": 1, "k_p": 1, "m_t": 1, "c_t": 1, "k_t": 1}
    preload: Preload = choice("trim", default="trim")
    m_t: Trajectory = item(read_trajectory(), "kg", Constant(two_dof_plant.TRUNK_MASS))
    c_t: Trajectory = item(read_trajectory(), "N s/m", Constant(two_dof_plant.TRUNK_DAMPING))
    k_t: Trajectory = item(read_trajectory(), "N/m", Constant(two_dof_plant.TRUNK_STIFFNESS))

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return a lever whose pilot's trunk moves on the seat."""
        return two_dof_plant.TwoDof(lever, **values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class HystereticPilot(Pilot):
    """The arm with structural damping: its loss factor is the same at every frequency."""

    model = "hysteretic"
    about = (
        "an arm whose tissue loses the same share of the energy of a cycle at every frequency, where a damper loses "
        "more the faster it moves"
    )
    about_dynamics = "The truth is the mode that answers most between 2 and 8 Hz."
    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "k_p": 1}
    preload: Preload = choice("trim", default="trim")
    m_p: Trajectory = item(read_trajectory(), "kg")
    k_p: Trajectory = item(read_trajectory(), "N/m")
    loss_factor: float = quantity("1", above=0.0, greatest=2.0)

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return a lever whose arm has hysteretic damping."""
        return hysteretic_plant.Hysteretic(lever, self.loss_factor, **values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class ReflexPilot(ArmPilot):
    """The arm of firmware/THEORY.md, and a stretch reflex."""

    model = "reflex"
    about = "an arm with a stretch reflex, which pulls against the motion a few hundredths of a second late"
    about_dynamics = "The truth is the mode that answers most between 2 and 8 Hz."
    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "c_p": 1, "k_p": 1, "k_r": 0, "c_r": 0}
    preload: Preload = choice("trim", default="trim")
    k_r: Trajectory = item(read_trajectory(), "N/m")
    c_r: Trajectory = item(read_trajectory(), "N s/m")
    delay: float = quantity("s", reflex_plant.DELAY, least=0.02, greatest=0.2)

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return a lever whose arm reacts a delay late."""
        return reflex_plant.Reflex(lever, self.delay, **values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class MayoPilot(Pilot):
    """A hand as Mayo has measured it."""

    model = "hand"
    about = "a hand that follows the cabin as Mayo (1989) measured it on people, by a transfer function"
    about_dynamics = "The truth is that of the poles of the hand's transfer function."
    signs: ClassVar[Mapping[str, int]] = {}
    preload: Preload = choice("trim", default="trim")
    somatotype: str = choice(*mayo_plant.HANDS)

    def build(self, time: FloatArray, values: Values, trim: FloatArray, lever: Lever) -> Truth:
        """Return the hand of the pilot's somatotype as Mayo measured it."""
        return mayo_plant.Mayo(mayo_plant.HANDS[self.somatotype], lever.lever_length, trim)


_ALL = (LeverPilot, PhysicalPilot, BlackBoxPilot, TwoDofPilot, MayoPilot, HystereticPilot, ReflexPilot)
MODELS: Mapping[str, type[Pilot]] = {kind.model: kind for kind in _ALL}

read_pilot = read_kind(MODELS, key="model", default=LeverPilot.model)
