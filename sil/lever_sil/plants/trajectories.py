"""How a parameter of the pilot, or the trim angle, goes in time.

Each class is one kind of table in a scenario, such as [pilot.k_p] with kind = "ramp"; a bare quantity is a constant.
Values are in the unit of the parameter.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from ..toml_tables import SIGNAL, Place, Reader, item, quantities, quantity, read_kind, read_list, read_quantity
from . import excitation


class Trajectory(ABC):
    """A value over time."""

    @abstractmethod
    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the value at the evenly spaced times `time` [s]."""

    def changes(self) -> tuple[float, ...]:
        """Return times [s] of the jumps, after which an estimator has to find the value anew."""
        return ()


def check_rising(times: tuple[float, ...]) -> None:
    """Raise ValueError unless each time is later than the one before."""
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise ValueError("the times in 'at' do not rise")


@dataclass(frozen=True)
class Constant(Trajectory):
    """Always the same."""

    value: float = quantity(SIGNAL)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the constant value."""
        return np.full_like(time, self.value)


@dataclass(frozen=True)
class Steps(Trajectory):
    """`first`, then the values `to` from the times `at` on."""

    first: float = quantity(SIGNAL)
    at: tuple[float, ...] = quantities("s", above=0.0)
    to: tuple[float, ...] = quantities(SIGNAL)

    def __post_init__(self) -> None:
        if len(self.at) != len(self.to):
            raise ValueError(f"{len(self.at)} times in 'at' but {len(self.to)} values in 'to'")
        check_rising(self.at)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return `first`, then each value of `to` from its time on."""
        return np.array((self.first, *self.to))[np.searchsorted(self.at, time, side="right")]

    def changes(self) -> tuple[float, ...]:
        """Return the times of the steps [s]."""
        return self.at


@dataclass(frozen=True)
class Ramp(Trajectory):
    """From `first` to `last`, straight, in `duration` from `start`."""

    first: float = quantity(SIGNAL)
    last: float = quantity(SIGNAL)
    start: float = quantity("s", least=0.0)
    duration: float = quantity("s", above=0.0)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a straight line from `first` to `last`, constant before and after."""
        return np.interp(time, (self.start, self.start + self.duration), (self.first, self.last))


@dataclass(frozen=True, kw_only=True)
class Fatigue(Trajectory):
    """From `first` towards `last` with a time constant, from `start`: an arm that tires."""

    first: float = quantity(SIGNAL)
    last: float = quantity(SIGNAL)
    start: float = quantity("s", 0.0, least=0.0)
    time_constant: float = quantity("s", above=0.0)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return an exponential approach from `first` to `last`."""
        elapsed = np.maximum(time - self.start, 0.0)
        return self.last + (self.first - self.last) * np.exp(-elapsed / self.time_constant)


def _read_phase(value: Any, place: Place) -> float | None:
    """Read a phase [rad]; "random" is None."""
    return None if value == "random" else read_quantity("rad")(value, place)


@dataclass(frozen=True)
class Sinusoid(Trajectory):
    """`mean` and a sine of `amplitude` and `frequency` about it; a `phase` that is None is random."""

    mean: float = quantity(SIGNAL)
    amplitude: float = quantity(SIGNAL)
    frequency: float = quantity("Hz", above=0.0)
    phase: float | None = item(_read_phase, default=0.0)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a sine about `mean`."""
        phase = rng.uniform(0.0, 2.0 * math.pi) if self.phase is None else self.phase
        return self.mean + self.amplitude * np.sin(2.0 * math.pi * self.frequency * time + phase)


@dataclass(frozen=True, kw_only=True)
class Noise(excitation.Noise, Trajectory):
    """`mean` and Gaussian noise about it, white from `low` to `high`, of exactly `rms` from `start` to `end`."""

    mean: float = quantity(SIGNAL)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return band-limited noise about `mean`."""
        return self.mean + self.samples(time, rng)


@dataclass(frozen=True)
class Moves(Trajectory):
    """A move up or down each `every`, of random size and in `duration`, never further than `greatest` from `first`."""

    first: float = quantity(SIGNAL)
    greatest: float = quantity(SIGNAL, least=0.0)
    every: float = quantity("s", above=0.0)
    duration: float = quantity("s", above=0.0)

    def __post_init__(self) -> None:
        if self.duration > self.every:
            raise ValueError(f"duration {self.duration:g} s is longer than every {self.every:g} s")

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return straight moves of uniformly distributed size; one that would lead too far goes the other way."""
        starts = self.every * np.arange(1.0, time[-1] // self.every + 1.0)
        places = [0.0]
        for move in rng.uniform(-self.greatest, self.greatest, len(starts)).tolist():
            places.append(places[-1] + (move if abs(places[-1] + move) <= self.greatest else -move))
        knots = np.stack((starts, starts + self.duration), axis=1).ravel()
        moved: FloatArray = np.interp(time, np.append(0.0, knots), np.repeat(places, 2)[:-1])
        return self.first + moved


@dataclass(frozen=True)
class RandomWalk(Trajectory):
    """A random walk of the logarithm at `rate`, reflected at the values `least` and `greatest`."""

    first: float = quantity(SIGNAL, above=0.0)
    rate: float = quantity("1/sqrt(s)", least=0.0)
    least: float = quantity(SIGNAL, above=0.0)
    greatest: float = quantity(SIGNAL, above=0.0)

    def __post_init__(self) -> None:
        if not self.least <= self.first <= self.greatest or self.least == self.greatest:
            raise ValueError("must have least <= first <= greatest and least < greatest")

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a random walk of the logarithm, reflected at `least` and `greatest`."""
        step = math.sqrt(float(time[1] - time[0])) if len(time) > 1 else 0.0
        walk = np.zeros_like(time)
        np.cumsum(self.rate * step * rng.standard_normal(len(time) - 1), out=walk[1:])
        span = math.log(self.greatest / self.least)
        folded = np.mod(math.log(self.first / self.least) + walk, 2.0 * span)
        return self.least * np.exp(span - np.abs(span - folded))


@dataclass(frozen=True)
class Sequence(Trajectory):
    """One trajectory after another: parts[0], from at[0] on parts[1], and so on; times count from the run's start."""

    at: tuple[float, ...] = quantities("s", above=0.0)
    parts: tuple[Trajectory, ...] = item(read_list(lambda value, place: read_trajectory()(value, place)))

    def __post_init__(self) -> None:
        if len(self.parts) != len(self.at) + 1:
            raise ValueError(f"{len(self.parts)} parts need {len(self.parts) - 1} times in 'at', not {len(self.at)}")
        check_rising(self.at)

    def values(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the values of one part after another, each in its own time of the run."""
        part = np.searchsorted(self.at, time, side="right")
        return np.stack([trajectory.values(time, rng) for trajectory in self.parts])[part, np.arange(len(time))]

    def changes(self) -> tuple[float, ...]:
        """Return the times between the parts, and those of the jumps inside them [s]."""
        edges = (0.0, *self.at, math.inf)
        inner = (
            time
            for trajectory, (begin, end) in zip(self.parts, pairwise(edges), strict=True)
            for time in trajectory.changes()
            if begin < time < end
        )
        return tuple(sorted({*self.at, *inner}))


KINDS: Mapping[str, type[Trajectory]] = {
    "steps": Steps,
    "ramp": Ramp,
    "fatigue": Fatigue,
    "sinusoid": Sinusoid,
    "noise": Noise,
    "moves": Moves,
    "random_walk": RandomWalk,
    "sequence": Sequence,
}


def read_trajectory() -> Reader:
    """Reader of a bare quantity (a constant) or a table with one of KINDS."""
    read_value, read_moving = read_quantity(SIGNAL), read_kind(KINDS)

    def reader(value: Any, place: Place) -> Trajectory:
        if isinstance(value, dict):
            return read_moving(value, place)  # type: ignore[no-any-return]
        return Constant(read_value(value, place))

    return reader
