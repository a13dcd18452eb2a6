"""Quantities with units, as text: "0.1 g", "60 s", "2 %/sqrt(s)"; the units are those of firmware/lever_units.def.

A general library (pint) takes half a second to import, a sixth of the time of a whole simulation, and reads "g" as gram
where an acceleration needs 9.80665 m/s^2.
"""

from __future__ import annotations

import math
import re
from functools import cache

from ..errors import LeverError
from ..runtime.files import native_file

GRAVITY = 9.80665
"""Standard gravity [m/s^2], the same number as in the firmware's model."""

_QUANTITY = re.compile(r"[ \t]*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)[ \t]*(.*?)[ \t]*")


class UnitError(LeverError):
    """A quantity that is not "number unit" with a unit of the dimension asked for."""


@cache
def spellings(unit: str) -> dict[str, float]:
    """Return what may be written for a `unit`, with the factor to it."""
    table = native_file("lever_units.def").read_text(encoding="ascii")
    rows = re.findall(r'^LEVER_UNIT\("(.*)", "(.*)", (.*)\)$', table, re.MULTILINE)
    return {spelling: float(factor) for of, spelling, factor in rows if of == unit}


def split(text: str) -> tuple[str, str] | None:
    """Return number and unit of a quantity, "" without one; None where it begins with no number."""
    match = _QUANTITY.fullmatch(text)
    return match and (match[1], match[2])


def number_of(text: str) -> float:
    """Return a number without a unit; NaN for what is none, or not finite."""
    parts = split(text)
    number = float(parts[0]) if parts and not parts[1] else math.nan
    return number if math.isfinite(number) else math.nan


def parse(text: object, unit: str) -> float:
    """Return the value of `text`, for example "0.1 g", in the SI `unit`, for example "m/s^2".

    A number of the unit 1 needs none: 0.5, as a number or as text. Raises UnitError.
    """
    if unit == "1" and isinstance(text, int | float) and not isinstance(text, bool):
        text = f"{text!r} 1"
    quantity = split(text) if isinstance(text, str) else None
    if quantity is None:
        raise UnitError(f'{text!r} is not a quantity; write a number and a unit in quotes, like "1.5 {unit}"')
    number, spelling = quantity
    spelling = "1" if unit == "1" and not spelling else spelling
    allowed = spellings(unit)
    if spelling not in allowed:
        said = f"unit {spelling!r}" if spelling else "no unit"
        raise UnitError(f"{text!r} has {said}; allowed: {', '.join(allowed)}")
    value = float(number) * allowed[spelling]
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is too large")
    return value
