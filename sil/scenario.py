"""A scenario: what happens in a run, as data. Read from scenarios/*.toml or any file of that form.

Every number stands with its unit, every random stream has its place under one seed. The estimator's settings are the
defaults of firmware/lever_settings.def but for those that [settings] overrides; the true lever is the one that the
estimator is told of but for what [lever] overrides.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.host_tools.errors import SettingsError
from lever_cdkf.host_tools.native import Config, enum_names, settings_table
from numpy.typing import NDArray

from . import excitation, plant, sensors, trajectories
from .reading import (
    SIGNAL,
    Place,
    Reader,
    ScenarioError,
    choice,
    item,
    quantity,
    read,
    read_kind,
    read_quantity,
    read_table,
    table,
    tables,
    text,
    whole,
)

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

FloatArray = NDArray[np.float64]

STREAMS = (
    "process", "theta", "theta_dot", "tau_m", "z_ddot", "m_p", "c_p", "k_p", "trim", "base", "torque", "dropout",
)  # fmt: skip
"""Purposes of random numbers; the order is part of what a seed means, so append only."""

_TRIM_KINDS = {kind: trajectories.KINDS[kind] for kind in ("steps", "ramp", "sinusoid")}


@dataclass(frozen=True, kw_only=True)
class FirmwareDither(excitation.Excitation):
    """Not a signal of ours: from start to end the firmware is asked, by COMMAND, for dither of `rms`."""

    rms: float = quantity(SIGNAL, least=0.0)

    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        return np.zeros_like(time)


_read_torque = read_kind({**excitation.KINDS, "firmware": FirmwareDither})


@dataclass(frozen=True, kw_only=True)
class Pilot:
    """[pilot]: the truth that is to be estimated."""

    m_p: trajectories.Trajectory = item(trajectories.read_trajectory(), "kg")
    c_p: trajectories.Trajectory = item(trajectories.read_trajectory(), "N s/m")
    k_p: trajectories.Trajectory = item(trajectories.read_trajectory(), "N/m")
    trim: trajectories.Trajectory | None = item(trajectories.read_trajectory(_TRIM_KINDS), "rad", None)
    preload: plant.Preload = choice("trim", "fixed", default="trim")
    process_noise: float = quantity("rad/s/sqrt(s)", 0.05, least=0.0)

    def __post_init__(self) -> None:
        if self.preload == "trim" and self.trim is None:
            raise ValueError("key 'trim' is missing, the angle at which the pilot lets the lever rest")
        if self.preload == "fixed" and self.trim is not None:
            raise ValueError("'trim' goes with preload trim; with fixed preload the lever rests where torques balance")


@dataclass(frozen=True)
class Motor:
    """[motor]: the torque follows its command with this time constant."""

    lag: float = quantity("s", 2e-3, least=0.0)


def _one_of(enum: str) -> Any:
    return choice(*enum_names(enum).values(), default=None)


@dataclass(frozen=True)
class Estimator:
    """[estimator]: choices that COMMAND makes at the start; the firmware's defaults for what is not chosen."""

    model: str | None = _one_of("lever_model")
    preload: str | None = _one_of("lever_preload")
    estimator: str | None = _one_of("lever_estimator")
    adaptation: str | None = _one_of("lever_adaptation")


@dataclass(frozen=True)
class Limits:
    """[limits]: what a run must keep for its verdict to be good; relative rms errors and the coverage of +-2 sigma."""

    m_p: float | None = quantity("1", None, above=0.0)
    c_p: float | None = quantity("1", None, above=0.0)
    k_p: float | None = quantity("1", None, above=0.0)
    natural_frequency: float | None = quantity("1", None, above=0.0)
    damping_ratio: float | None = quantity("1", None, above=0.0)
    coverage: float | None = quantity("1", None, above=0.0, greatest=1.0)


def _read_overrides(allowed: Iterable[str]) -> Reader:
    """Reader of a table of settings by the names of lever_settings.def, each in a unit of its dimension."""
    known = set(allowed)
    readers = {row.name: read_quantity(row.unit) for row in settings_table() if row.name in known}

    def reader(values: Any, place: Place) -> dict[str, float]:
        if not isinstance(values, dict):
            raise place.error(f"{values!r} is not a table")
        for name in values:
            if name not in readers:
                raise place.error(f"unknown key {name!r}; allowed: {', '.join(readers)}")
        return {name: readers[name](value, place.at(name)) for name, value in values.items()}

    return reader


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One run. Times in seconds from its start; see README.md for the keys with examples."""

    name: str = ""
    file: str = ""
    title: str = text()
    description: str = text("")
    duration: float = quantity("s", above=0.0, greatest=3600.0)
    converged_after: float = quantity("s", 15.0, least=0.0)
    seed: int = whole(1)
    pilot: Pilot = item(read_table(Pilot))
    base: tuple[excitation.Excitation, ...] = tables(excitation.read_excitation, "m/s^2")
    torque: tuple[excitation.Excitation, ...] = tables(_read_torque, "N m")
    motor: Motor = table(Motor)
    sensors: sensors.Sensors = table(sensors.Sensors)
    estimator: Estimator = table(Estimator)
    settings: Mapping[str, float] | None = item(_read_overrides(row.name for row in settings_table()), default=None)
    lever: Mapping[str, float] | None = item(_read_overrides(plant.Lever.__dataclass_fields__), default=None)
    limits: Limits = table(Limits)

    @cached_property
    def config(self) -> Config:
        """The estimator's configuration. Raises ScenarioError."""
        try:
            return Config(**dataclasses.asdict(self.estimator), settings=self.settings)
        except SettingsError as error:
            raise ScenarioError(f"{self.file}: settings: {error}") from None

    @property
    def period(self) -> float:
        """Sample period [s], in whole microseconds as the time in the frames."""
        return round(self.config.settings["sample_period"] * 1e6) * 1e-6

    @property
    def true_lever(self) -> plant.Lever:
        return plant.Lever.from_settings(self.config.settings | dict(self.lever or {}))

    def time(self) -> FloatArray:
        """Times of the samples [s], from 0."""
        return np.arange(max(2, round(self.duration / self.period)), dtype=np.float64) * self.period

    def stream(self, purpose: str, index: int = 0) -> np.random.Generator:
        """The random numbers for one purpose (of STREAMS) and item; no other draw shifts them."""
        key = (STREAMS.index(purpose), index)
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=key)))

    def streams(self, purpose: str, items: Iterable[object]) -> list[np.random.Generator]:
        """One stream for each of `items`."""
        return [self.stream(purpose, index) for index, _ in enumerate(items)]

    def truth(self, time: FloatArray) -> plant.Truth:
        """The pilot at the times `time` [s]. Raises ScenarioError when a parameter is not positive."""
        values = {}
        for name in ("m_p", "c_p", "k_p"):
            values[name] = getattr(self.pilot, name).values(time, self.stream(name))
            if not values[name].min() > 0.0:
                raise ScenarioError(f"{self.file}: pilot.{name}: falls to {values[name].min():g}; it must stay above 0")
        trim = self.pilot.trim
        return plant.Truth(
            **values, trim=np.zeros_like(time) if trim is None else trim.values(time, self.stream("trim"))
        )

    def check(self) -> None:
        """Raises ScenarioError for what only shows when the parts are put together."""
        self.truth(self.time())

    def changes(self) -> tuple[float, ...]:
        """Times [s] after which the parameters have to be found anew: the start, and every jump of one of them."""
        jumps = {time for name in ("m_p", "c_p", "k_p") for time in getattr(self.pilot, name).changes()}
        return (0.0, *sorted(time for time in jumps if time < self.duration))

    def dithers(self) -> list[tuple[float, float]]:
        """When [s] the firmware is to be asked for which rms [N m], in order of time."""
        events: dict[float, float] = {}
        for dither in self.torque:
            if isinstance(dither, FirmwareDither):
                events.setdefault(dither.end, 0.0)
                events[dither.start] = dither.rms
        return sorted((time, rms) for time, rms in events.items() if time < self.duration)


def names() -> list[str]:
    """The scenarios that come with the package."""
    folder = files(__package__) / "scenarios"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load(name_or_path: str, overrides: Iterable[str] = ()) -> Scenario:
    """The scenario of that name, or in the file of that path (ending in .toml), with "key.subkey=value" overrides.

    Raises ScenarioError.
    """
    if name_or_path.endswith(".toml"):
        path, file = Path(name_or_path), name_or_path
        if not path.is_file():
            raise ScenarioError(f"{file}: no such file")
        content, name = path.read_bytes(), path.stem
    elif name_or_path in names():
        name, file = name_or_path, f"{name_or_path}.toml"
        content = (files(__package__) / "scenarios" / file).read_bytes()
    else:
        raise ScenarioError(
            f"no scenario {name_or_path!r}; there are {', '.join(names())}, or give a path to a .toml file"
        )
    try:
        values = tomllib.loads(content.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{file}: not TOML: {error}") from None
    for override in overrides:
        _override(values, override)
    scenario = dataclasses.replace(read(Scenario, values, Place(file)), name=name, file=file)
    scenario.check()
    return scenario


def _override(values: dict[str, Any], override: str) -> None:
    """Puts "key.subkey=value" into the table; a number as subkey goes into a list, as in base.0.rms="0.2 g"."""
    key, equals, written = override.partition("=")
    *parents, last = key.strip().split(".")
    if not equals or not last:
        raise ScenarioError(f"--set {override}: must be KEY=VALUE, such as duration='10 s' or settings.m_p='3 kg'")
    target: Any = values
    try:
        for parent in parents:
            target = target[int(parent)] if isinstance(target, list) else target.setdefault(parent, {})
        if isinstance(target, list):
            target[int(last)] = _value(written)
        else:
            target[last] = _value(written)
    except (AttributeError, IndexError, TypeError, ValueError):
        raise ScenarioError(f"--set {override}: the scenario has no {key.strip()!r}") from None


def _value(written: str) -> Any:
    """As TOML when it is TOML, otherwise a string, so that a shell needs no second quotes."""
    try:
        return tomllib.loads(f"value = {written}")["value"]
    except tomllib.TOMLDecodeError:
        return written.strip()
