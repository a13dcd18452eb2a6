"""The table [pilot] of a scenario: a dataclass for each model of the truth, chosen by the key `model`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from . import linear_plant, mayo_plant, plant, two_dof_plant
from .reading import choice, item, quantity, read_kind
from .trajectories import KINDS, Constant, Trajectory, read_trajectory
from .truth import FloatArray, Truth

_TRIM_KINDS = {kind: KINDS[kind] for kind in ("steps", "ramp", "sinusoid")}
_SIDES = {1: "falls to {least:g}; it must stay above 0", -1: "rises to {greatest:g}; it must stay below 0"}


@dataclass(frozen=True, kw_only=True)
class Pilot(ABC):
    """What all pilots have. A parameter is a field of the name that `signs` gives it."""

    model: ClassVar[str]
    """Key `model` of the table."""
    signs: ClassVar[Mapping[str, int]]
    """The parameters: 1 for one that must stay above 0, -1 below 0, 0 for either."""

    trim: Trajectory | None = item(read_trajectory(_TRIM_KINDS), "rad", None)
    preload: plant.Preload = choice("trim", "fixed", default="trim")
    process_noise: float = quantity("rad/s/sqrt(s)", 0.05, least=0.0)

    def __post_init__(self) -> None:
        if self.preload == "trim" and self.trim is None:
            raise ValueError("key 'trim' is missing, the angle at which the pilot lets the lever rest")
        if self.preload == "fixed" and self.trim is not None:
            raise ValueError("'trim' goes with preload trim; with fixed preload the lever rests where torques balance")

    def trajectories(self) -> Mapping[str, Trajectory]:
        """How the parameters go, by name."""
        return {name: getattr(self, name) for name in self.signs}

    def truth(self, time: FloatArray, stream: Callable[[str], np.random.Generator], lever: plant.Lever) -> Truth:
        """The pilot on `lever` at the times [s]; `stream` gives the random numbers of a parameter.

        Raises ValueError for a parameter that loses its sign.
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
        return self.build(values, trim, lever)

    @abstractmethod
    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        """The truth with these parameters and trim angles."""


@dataclass(frozen=True, kw_only=True)
class LeverPilot(Pilot):
    """The arm of DESIGN section 3 on the lever."""

    model = "lever"
    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "c_p": 1, "k_p": 1}
    m_p: Trajectory = item(read_trajectory(), "kg")
    c_p: Trajectory = item(read_trajectory(), "N s/m")
    k_p: Trajectory = item(read_trajectory(), "N/m")

    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        return plant.LeverTruth(lever, plant.Truth(**values, trim=trim), self.preload)


@dataclass(frozen=True, kw_only=True)
class PhysicalPilot(Pilot):
    """Mass, damper and spring."""

    model = "linear_physical"
    signs: ClassVar[Mapping[str, int]] = {"m": 1, "c": 1, "k": 1}
    m: Trajectory = item(read_trajectory(), "kg")
    c: Trajectory = item(read_trajectory(), "N s/m")
    k: Trajectory = item(read_trajectory(), "N/m")

    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        return linear_plant.Physical(**values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class BlackBoxPilot(Pilot):
    """A second-order system, restoring and damped."""

    model = "linear_black_box"
    signs: ClassVar[Mapping[str, int]] = {"a21": -1, "a22": -1, "b21": 0}
    a21: Trajectory = item(read_trajectory(), "1/s^2")
    a22: Trajectory = item(read_trajectory(), "1/s")
    b21: Trajectory = item(read_trajectory(), "1")

    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        return linear_plant.BlackBox(**values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class TwoDofPilot(LeverPilot):
    """The arm hangs on a trunk that gives way on its seat."""

    model = "two_dof"
    signs: ClassVar[Mapping[str, int]] = {"m_p": 1, "c_p": 1, "k_p": 1, "m_t": 1, "c_t": 1, "k_t": 1}
    preload: plant.Preload = choice("trim", default="trim")
    m_t: Trajectory = item(read_trajectory(), "kg", Constant(two_dof_plant.TRUNK_MASS))
    c_t: Trajectory = item(read_trajectory(), "N s/m", Constant(two_dof_plant.TRUNK_DAMPING))
    k_t: Trajectory = item(read_trajectory(), "N/m", Constant(two_dof_plant.TRUNK_STIFFNESS))

    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        return two_dof_plant.TwoDof(lever, **values, trim=trim)


@dataclass(frozen=True, kw_only=True)
class MayoPilot(Pilot):
    """A hand as Mayo has measured it."""

    model = "mayo"
    signs: ClassVar[Mapping[str, int]] = {}
    preload: plant.Preload = choice("trim", default="trim")
    somatotype: str = choice(*mayo_plant.HANDS)

    def build(self, values: Mapping[str, FloatArray], trim: FloatArray, lever: plant.Lever) -> Truth:
        return mayo_plant.Mayo(mayo_plant.HANDS[self.somatotype], lever.lever_length, trim)


_ALL = (LeverPilot, PhysicalPilot, BlackBoxPilot, TwoDofPilot, MayoPilot)
MODELS: Mapping[str, type[Pilot]] = {kind.model: kind for kind in _ALL}

read_pilot = read_kind(MODELS, key="model", default=LeverPilot.model)
