"""Settings files, which `lever settings` prints and `lever_can --settings` reads: a configuration as text.

One `name = value` a line, `#` starts a comment, the last of two equal names counts; firmware/port/linux/settings.h has
the grammar, to the byte. Names are those of settings_table(), in its units unless another follows, and four choices:

    preload = trim           # one of fixed, trim
    theta_noise = 2 mrad     # 0.002: [rad] standard deviation of a theta sample
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import units
from ..errors import SettingsError
from ..units import UnitError
from .config import CHOICES, Config, Setting, choice_value, setting, settings_table
from .library import enum_names

Assignments = Mapping[str, str | float]
"""Values by name, of settings (float) and choices (str)."""

_BOM = b"\xef\xbb\xbf"
_BLANK = " \t"
_LINE_BYTES = 510


def parse_assignment(text: str) -> tuple[str, str | float]:
    """Name and checked value of the text `name = value`. Raises SettingsError."""
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
    """What is written for a setting, in its unit or with one of its units. Raises UnitError."""
    quantity = units.split(text)
    if quantity is None:
        allowed = ", ".join(units.spellings(row.unit))
        raise UnitError(f"{text!r} is not a number (give it in {row.unit}, or with a unit: {allowed})")
    number, unit = quantity
    return units.parse(text, row.unit) if unit else float(number)


def read_assignments(path: str | os.PathLike[str]) -> dict[str, str | float]:
    """What a settings file sets. Raises SettingsError with file and line."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read: {error.strerror}") from None
    assignments: dict[str, str | float] = {}
    for number, line in enumerate(content.removeprefix(_BOM).split(b"\n"), start=1):
        assignments |= _parse_line(line.removesuffix(b"\r"), f"{path}:{number}")
    return assignments


def _parse_line(line: bytes, place: str) -> dict[str, str | float]:
    """What a line assigns, if anything. Raises SettingsError."""
    text = line.partition(b"#")[0].decode(errors="backslashreplace").strip(_BLANK)
    try:
        if b"\0" in line:
            raise SettingsError("is not text")
        if len(line) > _LINE_BYTES:
            raise SettingsError(f"the line is longer than {_LINE_BYTES} bytes")
        return dict([parse_assignment(text)]) if text else {}
    except SettingsError as error:
        raise SettingsError(f"{place}: {error}") from None


def make_config(assignments: Assignments) -> Config:
    """The configuration with the firmware's defaults in all but `assignments`. Raises SettingsError."""
    choices: dict[str, Any] = {name: value for name, value in assignments.items() if name in CHOICES}
    settings: dict[str, Any] = {name: value for name, value in assignments.items() if name not in CHOICES}
    return Config(**choices, settings=settings)


def format_config(config: Config) -> str:
    """The text of a settings file that holds all of `config`."""
    return format_assignments({**config.choices, **config.settings})


def format_assignments(assignments: Assignments, notes: Mapping[str, str] | None = None) -> str:
    """The text of a settings file that holds these; `notes` by name go into the comments."""
    comments = {what: f"one of {', '.join(enum_names(f'lever_{what}').values())}" for what in CHOICES}
    comments |= {row.name: f"[{row.unit}] {row.meaning}" for row in settings_table()}
    comments |= {name: f"{comments[name]}; {note}" for name, note in (notes or {}).items()}
    lines = {name: f"{name} = {value}" for name, value in assignments.items()}
    width = max((len(line) for line in lines.values()), default=0)
    return "".join(f"{line:{width}}  # {comments[name]}\n" for name, line in lines.items())
