"""Settings files, which `lever settings` prints and `lever_can --settings` reads: a configuration as text.

One `name = value` a line, `#` starts a comment, the last of two equal names counts; firmware/port/linux/settings.h has
the grammar, to the byte. Names are those of settings_table(), in its units unless another follows, and the choices:

    preload = trim           # one of fixed, trim
    theta_noise = 2 mrad     # 0.002: [rad] standard deviation of a theta sample
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import SettingsError
from ..text import units
from ..text.units import UnitError
from .config import CHOICES, Config, Setting, choice_value, setting, settings_table
from .library import enum_names

Assignments = Mapping[str, str | float]
"""Values by name, of settings (float) and choices (str)."""

_BOM = b"\xef\xbb\xbf"
_BLANK = " \t"
_LINE_BYTES = 510


def parse_assignment(text: str) -> tuple[str, str | float]:
    """Return name and checked value of the text `name = value`. Raise SettingsError."""
    name, equals, value = (part.strip(_BLANK) for part in text.partition("="))
    if not equals:
        raise SettingsError(f"{name!r} has no '=': write name = value")
    if name in CHOICES:
        choice_value(f"lever_{name}", name, value)
        return name, value
    row = setting(name)
    try:
        number = setting_value(row, value)
    except UnitError as error:
        raise SettingsError(f"{name} = {error}") from None
    row.check(number)
    return name, number


def setting_value(row: Setting, text: str) -> float:
    """Return what is written for a setting, in its unit or with one of its units. Raise UnitError."""
    quantity = units.split(text)
    if quantity is None:
        allowed = ", ".join(units.spellings(row.unit))
        raise UnitError(f"{text!r} is not a number (give it in {row.unit}, or with a unit: {allowed})")
    number, unit = quantity
    return units.parse(text, row.unit) if unit else float(number)


def read_assignments(path: str | os.PathLike[str]) -> dict[str, str | float]:
    """Return what a settings file sets. Raise SettingsError with file and line."""
    assignments: dict[str, str | float] = {}
    for place, text in lines_of(path):
        try:
            assignments |= dict([parse_assignment(text)])
        except SettingsError as error:  # noqa: PERF203
            raise SettingsError(f"{place}: {error}") from None
    return assignments


def lines_of(path: str | os.PathLike[str]) -> Iterator[tuple[str, str]]:
    """Yield the lines of a file, as FILE:LINE and text; raise SettingsError.

    They are without comments, blanks around it and lines of these alone.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read: {error.strerror}") from None
    for number, line in enumerate(content.removeprefix(_BOM).split(b"\n"), start=1):
        text, place = line.removesuffix(b"\r"), f"{path}:{number}"
        if b"\0" in text:
            raise SettingsError(f"{place}: is not text")
        if len(text) > _LINE_BYTES:
            raise SettingsError(f"{place}: the line is longer than {_LINE_BYTES} bytes")
        if kept := text.partition(b"#")[0].decode(errors="backslashreplace").strip(_BLANK):
            yield place, kept


def make_config(assignments: Assignments) -> Config:
    """Return the configuration with the firmware's defaults in all but `assignments`. Raise SettingsError."""
    choices: dict[str, Any] = {name: value for name, value in assignments.items() if name in CHOICES}
    settings: dict[str, Any] = {name: value for name, value in assignments.items() if name not in CHOICES}
    return Config(**choices, settings=settings)


def format_config(config: Config) -> str:
    """Return the text of a settings file that holds all of `config`."""
    return format_assignments({**config.choices, **config.settings})


def format_assignments(assignments: Assignments, notes: Mapping[str, str] | None = None) -> str:
    """Return the text of a settings file that holds these; `notes` by name go into the comments."""
    comments = {what: f"one of {', '.join(enum_names(f'lever_{what}').values())}" for what in CHOICES}
    comments |= {row.name: f"[{row.unit}] {row.meaning}" for row in settings_table()}
    comments |= {name: f"{comments[name]}; {note}" for name, note in (notes or {}).items()}
    lines = {name: f"{name} = {value}" for name, value in assignments.items()}
    width = max((len(line) for line in lines.values()), default=0)
    return "".join(f"{line:{width}}  # {comments[name]}\n" for name, line in lines.items())
