"""A scenario: what happens in a run, as data. Read from scenarios/*.toml or any file of that form.

Every number stands with its unit, every random stream has its place under one seed. The estimator's settings are the
defaults of firmware/lever_settings.def but for those that [settings] overrides; the true lever is the one that the
estimator is told of but for what [lever] overrides.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware import quantities
from lever_cdkf.firmware.aircraft import AircraftResponse
from lever_cdkf.firmware.config import CHOICES, Setting
from lever_cdkf.firmware.native import Config, enum_names, settings_table
from lever_cdkf.firmware.settings_file import setting_value
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.results.trace import CONVERGED_AFTER
from lever_cdkf.text.suggestions import nearest_names
from lever_cdkf.text.toml_text import MOST_NESTED
from lever_cdkf.text.units import UnitError

from ..aircraft.aircraft import Coupled, read_aircraft
from ..aircraft.response_table import known_response
from ..plants import excitation, lever_plant, pilots
from ..plants.sensors import VALUES, Corruption, Sensor, Sensors
from ..plants.truth import Truth
from ..toml_tables import (
    SIGNAL,
    Place,
    Reader,
    ScenarioError,
    Shelf,
    choice,
    file_of,
    item,
    parse,
    quantity,
    read,
    read_kind,
    read_quantity,
    table,
    tables,
    text,
    value_of,
    whole,
)
from . import random_streams


@dataclass(frozen=True, kw_only=True)
class FirmwareDither(excitation.Excitation):
    """Not a signal of ours: from start to end the firmware is asked, by COMMAND, for dither of `rms`."""

    rms: float = quantity(SIGNAL, least=0.0)

    def scaled(self, time: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return zeros: the firmware makes this torque."""
        return np.zeros_like(time)


_read_torque = read_kind({**excitation.KINDS, "firmware": FirmwareDither})


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
    mitigation: str | None = _one_of("lever_mitigation")


def _read_numbers(readers: Mapping[str, Reader]) -> Reader:
    """Reader of a table of quantities by name."""

    def reader(values: Any, place: Place) -> dict[str, float]:
        place.check_table(values, readers)
        return {name: readers[name](value, place.at(name)) for name, value in values.items()}

    return reader


def _read_settings() -> Reader:
    """Reader of a table of settings by the names of lever_settings.def."""
    return _read_numbers({row.name: _read_setting(row) for row in settings_table()})


def _read_setting(row: Setting) -> Reader:
    """Reader of a setting as everywhere: with a unit, or as a number in the unit of lever_settings.def."""

    def reader(value: Any, place: Place) -> float:
        try:
            return setting_value(row, value if isinstance(value, str) else repr(value))
        except UnitError as error:
            raise place.error(str(error)) from None

    return reader


def _read_lever() -> Reader:
    """Reader of a table of what is constant in a lever; only angles may be below 0."""
    units = {row.name: row.unit for row in settings_table()}
    readers = {}
    for name in lever_plant.Lever.__dataclass_fields__:
        readers[name] = read_quantity(units[name], least=-math.inf if units[name] == "rad" else 0.0)
    return _read_numbers(readers)


def _read_limits() -> Reader:
    """Reader of [limits]: greatest relative rms error of quantities, and the least coverage of +-2 sigma."""
    parameters = (each for model in enum_names("lever_model").values() for each in quantities.parameters(model))
    readers = {each.key: read_quantity("1", above=0.0) for each in (*parameters, *quantities.DYNAMICS)}
    return _read_numbers({**readers, "coverage": read_quantity("1", above=0.0, greatest=1.0)})


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """One run. Times in seconds from its start; see README.md for the keys with examples."""

    name: str = ""
    file: str = ""
    title: str = text()
    description: str = text("")
    duration: float = quantity("s", above=0.0, greatest=3600.0)
    converged_after: float = quantity("s", CONVERGED_AFTER, least=0.0)
    seed: int = whole(1)
    pilot: pilots.Pilot = item(pilots.read_pilot)
    aircraft: Coupled | None = item(read_aircraft, default=None)
    base: tuple[excitation.Excitation, ...] = tables(excitation.read_excitation, "m/s^2")
    torque: tuple[excitation.Excitation, ...] = tables(_read_torque, "N m")
    disturbance: tuple[excitation.Excitation, ...] = tables(excitation.read_excitation, "N m")
    motor: Motor = table(Motor)
    sensors: Sensors = table(Sensors)
    estimator: Estimator = table(Estimator)
    settings: Mapping[str, float] | None = item(_read_settings(), default=None)
    lever: Mapping[str, float] | None = item(_read_lever(), default=None)
    limits: Mapping[str, float] | None = item(_read_limits(), default=None)

    @cached_property
    def config(self) -> Config:
        """The estimator's configuration. Raise ScenarioError."""
        try:
            return Config(**dataclasses.asdict(self.estimator), settings=self.settings)
        except SettingsError as error:
            raise ScenarioError(f"{self.file}: settings: {error}") from None

    @cached_property
    def known_aircraft(self) -> AircraftResponse | None:
        """What the estimator is given of the aircraft, so that it watches the margin."""
        return None if self.aircraft is None else known_response(self.aircraft)

    @cached_property
    def period(self) -> float:
        """Sample period [s], in whole microseconds as the time in the frames."""
        return round(self.config.settings["sample_period"] * 1e6) * 1e-6

    @cached_property
    def true_lever(self) -> lever_plant.Lever:
        """The constants of the true lever: the settings, with the differences of [lever]."""
        return lever_plant.Lever.from_settings(self.config.settings | dict(self.lever or {}))

    def time(self) -> FloatArray:
        """Return times of the samples [s], from 0."""
        return np.arange(max(2, round(self.duration / self.period)), dtype=np.float64) * self.period

    def stream(self, purpose: str, index: int = 0) -> np.random.Generator:
        """Return the random numbers for one purpose and item; no other draw shifts them."""
        return random_streams.stream(self.seed, purpose, index)

    def streams(self, purpose: str, items: Iterable[object]) -> list[np.random.Generator]:
        """Return one stream for each of `items`."""
        return [self.stream(purpose, index) for index, _ in enumerate(items)]

    def corruption(self, what: str, time: FloatArray) -> Corruption:
        """Return what the faults of the sensor of `what` (one of sensors.VALUES) do at the times `time` [s]."""
        sensor: Sensor = getattr(self.sensors, what)
        return sensor.corruption(time, self.period, self.stream("fault", VALUES.index(what)))

    def truth(self, time: FloatArray) -> Truth:
        """Return the pilot on his lever at the times `time` [s]. Raise ScenarioError when he cannot be."""
        try:
            return self.pilot.truth(time, self.stream, self.true_lever)
        except ValueError as error:
            raise ScenarioError(f"{self.file}: pilot.{error}") from None

    def judged(self) -> tuple[quantities.Quantity, ...]:
        """Return what there is a truth of.

        It is everything, or no parameters when the pilot is not of the estimator's model.
        """
        model = self.config.choices["model"]
        return quantities.quantities(model) if self.pilot.model == model else quantities.DYNAMICS

    def check(self) -> None:
        """Raise ScenarioError for what only shows when the parts are put together."""
        truth = self.truth(self.time())
        if self.aircraft is not None and self.aircraft.aircraft.delay < self.period:
            raise ScenarioError(
                f"{self.file}: aircraft.delay: must be at least the sample period of {1e3 * self.period:g} ms"
            )
        for key, excitations in (("torque", self.torque), ("disturbance", self.disturbance)):
            if excitations and not truth.takes_torque:
                raise ScenarioError(f"{self.file}: {key}: no torque acts on a pilot of model {truth.model}; remove it")
        if self.sensors.grip_force is not None and not truth.has_grip_force:
            raise ScenarioError(
                f"{self.file}: sensors.grip_force: a pilot of model {truth.model} has no grip force; remove it"
            )
        judged = {quantity.key for quantity in self.judged()} | {"coverage"}
        for name in self.limits or ():
            if name not in judged:
                raise ScenarioError(f"{self.file}: limits.{name}: this run has no true value of it")

    def changes(self) -> tuple[float, ...]:
        """Return times [s] after which the parameters have to be found anew.

        They are the start, and every jump of one of them.
        """
        return (0.0, *sorted(time for time in self.pilot.changes() if 0.0 < time < self.duration))

    def dithers(self) -> list[tuple[float, float]]:
        """When [s] the firmware is to be asked for which rms [N m], in order of time."""
        events: dict[float, float] = {}
        for dither in self.torque:
            if isinstance(dither, FirmwareDither):
                events.setdefault(dither.end, 0.0)
                events[dither.start] = dither.rms
        return sorted((time, rms) for time, rms in events.items() if time < self.duration)


SHELF = Shelf("scenario", __package__)
names = SHELF.names


def load(name_or_path: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Scenario:
    """Return a scenario, checked.

    Parameters
    ----------
    name_or_path
        A name of `lever sim --list`, or the path of a file that ends in .toml.
    overrides
        Changes to it, each "key.subkey=value" with the unit in the value, as "duration=20 s".

    Returns
    -------
    Scenario
        For simulate().

    Raises
    ------
    ScenarioError
        There is no such scenario, or something in it is wrong; one line names it.
    """
    if not isinstance(name_or_path, (str, os.PathLike)):
        raise ScenarioError(f"{name_or_path!r} is no scenario: give its name, or the path of a .toml file")
    name, given = os.fspath(name_or_path), list(overrides)
    content = SHELF.content(name)
    try:
        return from_toml(content, name, given)
    except ScenarioError as error:
        raise ScenarioError(_with_cause(str(error), content, name, given)) from None


def _with_cause(said: str, content: bytes, name: str, overrides: list[str]) -> str:
    """Return an error with the first override that it occurs with in place of the file, unless it is the file's own."""
    for count in range(len(overrides) + 1):
        try:
            from_toml(content, name, overrides[:count])
        except ScenarioError as error:  # noqa: PERF203
            if str(error) == said:
                break
    if count == 0 or said.startswith("--set "):
        return said
    return f"--set {overrides[count - 1]}: {said.removeprefix(f'{file_of(name)}: ')}"


def from_toml(content: bytes, name_or_path: str, overrides: Iterable[str] = ()) -> Scenario:
    """As load(), of what the file holds."""
    file = file_of(name_or_path)
    values = parse(content, file)
    for override in overrides:
        _override(values, override)
    scenario = dataclasses.replace(read(Scenario, values, Place(file)), name=Path(file).stem, file=file)
    scenario.check()
    return scenario


def _override(values: dict[str, Any], override: str) -> None:
    """Put "key.subkey=value" into the table; a number as subkey goes into a list, as in base.0.rms="0.2 g".

    The number after the last of a list appends to it.

    Settings and choices of the estimator may stand without the name of their table, as in all commands.
    """
    key, equals, written = override.partition("=")
    *parents, last = key.strip().split(".")
    if not equals or not last or len(parents) > MOST_NESTED:
        raise ScenarioError(f"--set {override}: must be KEY=VALUE, such as duration='10 s' or settings.m_p='3 kg'")
    target: Any = values
    if not parents and last in CHOICES and isinstance(value_of(written), str):
        parents = ["estimator"]
    elif not parents and last not in Scenario.__dataclass_fields__:
        parents = ["settings"] if nearest_names(last, (row.name for row in settings_table())) else []
    at = ""
    try:
        for parent, child in zip(parents, [*parents, last][1:], strict=True):
            nothing: Any = [] if child.isdecimal() else {}
            target = target[int(parent)] if isinstance(target, list) else target.setdefault(parent, nothing)
            at = f"{at}.{parent}".removeprefix(".")
        if not isinstance(target, list):
            target[last] = value_of(written)
        elif int(last) == len(target):
            target.append(value_of(written))
        else:
            target[int(last)] = value_of(written)
    except (AttributeError, IndexError, TypeError, ValueError):
        raise ScenarioError(f"--set {override}: the scenario has no {key.strip()!r}{_entries(target, at)}") from None


def _entries(target: Any, path: str) -> str:
    """Return how to name an entry of a list, or a further one."""
    if not isinstance(target, list):
        return ""
    count = len(target)
    return (
        f"; {path} has {count} entr{'y' if count == 1 else 'ies'}, counted from 0: {path}.{count}={{...}} appends one"
    )
