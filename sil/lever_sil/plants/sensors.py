"""What the inceptor's computer gets to see of lever and base.

A sensor gives (1 + gain_error) x(t - delay) + bias + noise. Quantisation is that of the CAN codec, for which a value
beyond its range is not valid; nothing is rounded here. A fault makes a reading wrong that still counts as valid. A
Dropout says when a value is marked invalid or a whole frame is never sent.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from numpy.typing import NDArray

from ..toml_tables import SIGNAL, choice, item, quantity, read_kind, read_table, tables
from .window import Window

VALUES = ("theta", "theta_dot", "tau_m", "z_ddot", "grip_force")
FRAMES = ("lever_frame", "base_frame")
INVALID = math.nan
"""The reading of a sensor that marks it as invalid."""


@dataclass(frozen=True)
class Corruption:
    """What faults make of the readings of a sensor: factor * reading[source] + offset, an array a sample each."""

    source: NDArray[np.intp]
    factor: FloatArray
    offset: FloatArray
    period: float
    """From sample to sample [s]."""

    @classmethod
    def none(cls, count: int, period: float) -> Corruption:
        """Return what leaves `count` readings as they are."""
        return cls(np.arange(count), np.ones(count), np.zeros(count), period)

    def of(self, readings: FloatArray) -> FloatArray:
        """Return all readings with the faults in them."""
        return self.factor * readings[self.source] + self.offset


@dataclass(frozen=True, kw_only=True)
class Fault(Window, ABC):
    """What is wrong with a sensor from start (included) to end (excluded), without its being marked invalid."""

    @abstractmethod
    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Add the fault to `corruption` at the samples `inside`, at least one."""


@dataclass(frozen=True, kw_only=True)
class Stuck(Fault):
    """The last reading before, noise and all, over and over."""

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Repeat the last reading before the fault."""
        corruption.source[inside] = max(inside[0] - 1, 0)


@dataclass(frozen=True, kw_only=True)
class Reads(Fault):
    """A reading of `value`, whatever is true."""

    value: float = quantity(SIGNAL)

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Put the value in place of the readings."""
        corruption.factor[inside], corruption.offset[inside] = 0.0, self.value


@dataclass(frozen=True, kw_only=True)
class Late(Fault):
    """The reading of `delay` before."""

    delay: float = quantity("s", above=0.0)

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Read earlier samples, the nearest ones."""
        corruption.source[inside] = np.maximum(inside - round(self.delay / corruption.period), 0)


@dataclass(frozen=True, kw_only=True)
class Gradual(Fault):
    """Something that comes `over` some time, or at once."""

    over: float = quantity("s", 0.0, least=0.0)

    def reached(self, count: int, period: float) -> FloatArray:
        """Return how much of it there is at each of `count` samples, from 0 to 1."""
        if self.over == 0.0:
            return np.ones(count)
        reached: FloatArray = np.minimum(np.arange(count) * (period / self.over), 1.0)
        return reached


@dataclass(frozen=True, kw_only=True)
class Scale(Gradual):
    """The reading times `factor`: 0 of a dead sensor, -1 of one wired the wrong way round."""

    factor: float = quantity("1")

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Multiply the readings by `factor`."""
        reached = self.reached(len(inside), corruption.period)
        corruption.factor[inside] *= (1.0 - reached) + self.factor * reached


@dataclass(frozen=True, kw_only=True)
class Offset(Gradual):
    """The reading plus `size`."""

    size: float = quantity(SIGNAL)

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Add `size` to the readings."""
        corruption.offset[inside] += self.size * self.reached(len(inside), corruption.period)


@dataclass(frozen=True, kw_only=True)
class Spikes(Fault):
    """A `share` of the samples, drawn one by one, is off by `size`, up or down."""

    share: float = quantity("1", above=0.0, greatest=1.0)
    size: float = quantity(SIGNAL, above=0.0)

    def corrupt(self, inside: NDArray[np.intp], corruption: Corruption, rng: np.random.Generator) -> None:
        """Add or subtract `size` at random samples."""
        hit = inside[rng.random(len(inside)) < self.share]
        corruption.offset[hit] += self.size * rng.choice((-1.0, 1.0), len(hit))


FAULTS: dict[str, type[Fault]] = {
    "stuck": Stuck, "reads": Reads, "late": Late, "scale": Scale, "offset": Offset, "spikes": Spikes
}  # fmt: skip


@dataclass(frozen=True)
class Sensor:
    """One sensor; noise is the standard deviation of a sample, delay may be any part of a sample period."""

    noise: float = quantity(SIGNAL, 0.0, least=0.0)
    bias: float = quantity(SIGNAL, 0.0)
    gain_error: float = quantity("1", 0.0, above=-1.0)
    delay: float = quantity("s", 0.0, least=0.0)
    fault: tuple[Fault, ...] = tables(read_kind(FAULTS))

    def offsets(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return what is added to `count` samples: bias and noise."""
        offsets: FloatArray = rng.standard_normal(count)
        offsets *= self.noise
        offsets += self.bias
        return offsets

    def lag(self, period: float) -> tuple[int, float]:
        """Return the delay as whole sample periods and the part of one beyond, for linear interpolation."""
        samples = self.delay / period
        whole = math.floor(samples + 1e-9)
        return whole, max(0.0, samples - whole)

    def measure(self, signal: FloatArray, period: float, rng: np.random.Generator) -> FloatArray:
        """Return all samples of a `signal` that is known beforehand; before its start it had its first value."""
        whole, part = self.lag(period)
        delayed = signal
        if whole or part:
            at = np.arange(len(signal)) - (whole + part)
            delayed = np.interp(at, np.arange(len(signal)), signal)
        return (1.0 + self.gain_error) * delayed + self.offsets(len(signal), rng)

    def corruption(self, time: FloatArray, period: float, rng: np.random.Generator) -> Corruption:
        """Return what its faults do at the times `time` [s], a `period` apart."""
        corruption = Corruption.none(len(time), period)
        for fault in self.fault:
            inside = np.flatnonzero(fault.contains(time))
            if len(inside):
                fault.corrupt(inside, corruption, rng)
        return corruption


@dataclass(frozen=True)
class Dropout(Window):
    """Something missing for `share` of the time in its window, in bursts of `burst` on average."""

    what: str = choice(*VALUES, *FRAMES)
    share: float = quantity("1", above=0.0, greatest=1.0)
    burst: float = quantity("s", 1e-3, above=0.0)

    def missing(self, time: FloatArray, period: float, rng: np.random.Generator) -> BoolArray:
        """Return True at the samples `time` [s] that are missing: Gilbert's two states, geometric bursts and pauses."""
        inside = self.contains(time)
        if self.share == 1.0:
            return inside
        burst = max(1.0, self.burst / period)
        pause = burst * (1.0 - self.share) / self.share
        if pause < 1.0:
            burst, pause = burst / pause, 1.0
        turns = 2 + 2 * math.ceil(len(time) / (burst + pause)) + 64
        lengths = np.stack((rng.geometric(1.0 / pause, turns), rng.geometric(1.0 / burst, turns)), axis=1).ravel()
        pattern = np.repeat(np.tile((False, True), turns), lengths)
        missing: BoolArray = inside & pattern[: len(time)]
        return missing


def _sensor(unit: str, noise: float) -> Any:
    """Return a field that holds a sensor; unless its table says otherwise it has this noise."""
    return item(read_table(Sensor, noise=noise), unit, Sensor(noise=noise))


@dataclass(frozen=True)
class Sensors:
    """All sensors; the defaults are the standard values.

    These are 1 mrad and 10 mrad/s of noise, a fair accelerometer and torque sensor; no sensor of the grip force.
    """

    theta: Sensor = _sensor("rad", 1e-3)
    theta_dot: Sensor = _sensor("rad/s", 1e-2)
    z_ddot: Sensor = _sensor("m/s^2", 0.01)
    tau_m: Sensor = _sensor("N m", 2e-3)
    grip_force: Sensor | None = item(read_table(Sensor), "N", None)
    dropout: tuple[Dropout, ...] = tables(read_table(Dropout))


def missing(
    dropouts: Sequence[Dropout], what: str, time: FloatArray, period: float, rngs: Sequence[np.random.Generator]
) -> BoolArray:
    """Return True at the samples in which any of `dropouts` takes `what`; one random stream for each dropout."""
    gone = np.zeros(len(time), dtype=np.bool_)
    for dropout, rng in zip(dropouts, rngs, strict=True):
        if dropout.what == what:
            gone |= dropout.missing(time, period, rng)
    return gone
