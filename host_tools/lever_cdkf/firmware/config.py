"""The configuration of an estimator, checked against the firmware's own table of settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from numbers import Real
from typing import Any, NamedTuple

from ..errors import SettingsError
from ..text.suggestions import did_you_mean
from .library import enum_names, ffi, lib

CHOICES = ("model", "preload", "estimator", "adaptation", "mitigation")
"""What is chosen by name and not by number; the names are those of the façade's enums."""


def single(value: float) -> float:
    """`value` rounded to single precision."""
    return float(ffi.cast("float", value))


@dataclass(frozen=True)
class Setting:
    """One tunable number of the estimator: a row of firmware/lever_settings.def."""

    name: str
    unit: str
    default: float
    least: float
    greatest: float
    meaning: str

    def check(self, value: float) -> None:
        """Raise SettingsError unless `value`, in single precision, is a number in the range."""
        is_number = isinstance(value, Real) and not isinstance(value, bool)
        if not is_number or not single(self.least) <= single(value) <= single(self.greatest):
            raise SettingsError(
                f"{self.name} = {value if is_number else repr(value)} is out of range: it must be a number from "
                f"{self.least:g} to {self.greatest:g} {self.unit} ({self.meaning})"
            )


@lru_cache(maxsize=4096)
def shortest(value: float) -> float:
    """Return the number with the fewest digits that is `value` in single precision: 0.1 for 0.100000001."""
    candidates = (float(f"{value:.{digits}g}") for digits in range(1, 10))
    return next(candidate for candidate in candidates if single(candidate) == value)


@cache
def settings_table() -> tuple[Setting, ...]:
    """Return all settings with unit, default, range and meaning, in the firmware's order."""
    rows = (lib.lever_setting(index) for index in range(lib.lever_setting_count()))
    return tuple(
        Setting(
            name=ffi.string(row.name).decode(),
            unit=ffi.string(row.unit).decode(),
            default=shortest(row.value),
            least=shortest(row.least),
            greatest=shortest(row.greatest),
            meaning=ffi.string(row.meaning).decode(),
        )
        for row in rows
    )


def setting(name: str) -> Setting:
    """Return the row of a setting. Raise SettingsError, with the nearest name there is."""
    rows = {row.name: row for row in settings_table()}
    if not isinstance(name, str):
        raise SettingsError(f"{name!r} is no name of a setting; `lever settings` lists them all")
    if name not in rows:
        raise SettingsError(f"unknown setting {name!r}; {did_you_mean(name, rows, '`lever settings` lists them all')}")
    return rows[name]


def choice_value(enum: str, what: str, name: str) -> int:
    """Return the number of `name` in a façade enum. Raise SettingsError, with what is allowed for `what`."""
    for value, candidate in enum_names(enum).items():
        if candidate == name:
            return value
    raise SettingsError(f"{what} = {name!r} is not known; allowed: {', '.join(enum_names(enum).values())}")


class Parameter(NamedTuple):
    """What a model estimates."""

    name: str
    unit: str


@cache
def model_parameters(model: str) -> tuple[Parameter, ...]:
    """Return the parameters of a model, in the order of lever_estimate_t.

    Parameters
    ----------
    model
        A name of enum_names("lever_model").

    Returns
    -------
    tuple of Parameter
        Name and unit of each of the three.

    Raises
    ------
    SettingsError
        The firmware has no such model.
    """
    number = choice_value("lever_model", "model", model)
    return tuple(
        Parameter(
            ffi.string(lib.lever_parameter_name(number, index)).decode(),
            ffi.string(lib.lever_parameter_unit(number, index)).decode(),
        )
        for index in range(lib.LEVER_PARAMETERS)
    )


class Config:
    """A configuration that the firmware accepts.

    What is not given is as in the firmware's defaults.

    Parameters
    ----------
    model
        A name of enum_names("lever_model"); default "lever".
    preload
        A name of enum_names("lever_preload"); default "trim".
    estimator
        A name of enum_names("lever_estimator"); default "dual".
    adaptation
        A name of enum_names("lever_adaptation"); default "robbins_monro".
    settings
        Values by name, in the units of settings_table().
    mitigation
        A name of enum_names("lever_mitigation"); default "none".

    Raises
    ------
    SettingsError
        The firmware would refuse it; one line names key, unit and range.
    """

    def __init__(
        self,
        model: str | None = None,
        preload: str | None = None,
        estimator: str | None = None,
        adaptation: str | None = None,
        settings: Mapping[str, float] | None = None,
        *,
        mitigation: str | None = None,
    ) -> None:
        self.pointer: Any = ffi.new("lever_config_t *")
        """For calls of `lib`; valid as long as this object. Checked here, so leave it as it is."""
        lib.lever_config_default(self.pointer)
        for what, name in zip(CHOICES, (model, preload, estimator, adaptation, mitigation), strict=True):
            if name is not None:
                setattr(self.pointer, what, choice_value(f"lever_{what}", what, name))
        if not isinstance(settings, Mapping | None):
            raise SettingsError(f"settings = {settings!r}: give values by name, as {{'k_p_walk': 0.1}}")
        for name, value in (settings or {}).items():
            setting(name).check(value)
            setattr(self.pointer.settings, name, value)
        refused = lib.lever_config_check(self.pointer)
        if refused != ffi.NULL:
            key = ffi.string(refused).decode()
            raise SettingsError(f"{key} = {(self.choices | self.settings)[key]} does not go with the other settings")

    @property
    def settings(self) -> dict[str, float]:
        """The value of every setting."""
        return {row.name: shortest(getattr(self.pointer.settings, row.name)) for row in settings_table()}

    @property
    def choices(self) -> dict[str, str]:
        """Names of model, preload, estimator, adaptation and mitigation."""
        return {what: enum_names(f"lever_{what}")[getattr(self.pointer, what)] for what in CHOICES}

    @property
    def settings_crc(self) -> int:
        """The CRC-32 over the settings, by which an estimator tells in IDENTITY which ones it has."""
        return int(lib.lever_settings_crc(ffi.addressof(self.pointer, "settings")))


def given(config: Config | None) -> Config:
    """Return `config`, or the defaults. Raise SettingsError for what is none."""
    if not isinstance(config, Config | None):
        raise SettingsError(f"config is a {type(config).__name__}: give a Config, as Config(model='lever')")
    return config or Config()
