"""Quantities with units, as text: "0.1 g", "60 s", "2 %/sqrt(s)".

A scenario may only say a number together with its unit, and the unit must be of the dimension that its key asks for.
The table below is all that a lever on a shaken base needs. A general library (pint) takes half a second to import,
a sixth of the time of a whole simulation, and reads "g" as gram where we need 9.80665 m/s^2.
"""

from __future__ import annotations

import math
import re

from lever_cdkf.host_tools.errors import LeverError

GRAVITY = 9.80665
"""Standard gravity [m/s^2], the same number as in the firmware's model."""

_DEG = math.pi / 180.0

# SI unit -> {spelling: factor to the SI unit}
_SPELLINGS: dict[str, dict[str, float]] = {
    "1": {"1": 1.0, "%": 0.01},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3, "rpm": 1.0 / 60.0},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "kg": {"kg": 1.0, "g": 1e-3},
    "kg m^2": {"kg m^2": 1.0},
    "rad": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": _DEG},
    "rad/s": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": _DEG},
    "m/s^2": {"m/s^2": 1.0, "g": GRAVITY, "mg": 1e-3 * GRAVITY},
    "N": {"N": 1.0, "kN": 1e3},
    "N m": {"N m": 1.0, "mN m": 1e-3},
    "N m/s": {"N m/s": 1.0},
    "N s/m": {"N s/m": 1.0},
    "N/m": {"N/m": 1.0, "N/mm": 1e3},
    "N m s/rad": {"N m s/rad": 1.0},
    "N m/rad": {"N m/rad": 1.0},
    "1/s": {"1/s": 1.0},
    "1/s^2": {"1/s^2": 1.0},
    "1/sqrt(s)": {"1/sqrt(s)": 1.0, "%/sqrt(s)": 0.01},
    "1/s/sqrt(s)": {"1/s/sqrt(s)": 1.0},
    "1/s^2/sqrt(s)": {"1/s^2/sqrt(s)": 1.0},
    "rad/sqrt(s)": {"rad/sqrt(s)": 1.0, "mrad/sqrt(s)": 1e-3},
    "rad/s/sqrt(s)": {"rad/s/sqrt(s)": 1.0, "mrad/s/sqrt(s)": 1e-3},
}

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


class UnitError(LeverError):
    """A quantity that is not "number unit" with a unit of the dimension asked for."""


def parse(text: object, unit: str) -> float:
    """Value of `text`, for example "0.1 g", in the SI `unit`, for example "m/s^2". Raises UnitError."""
    spellings = _SPELLINGS[unit]
    allowed = ", ".join(spellings)
    match = _QUANTITY.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise UnitError(f'{text!r} is not a quantity; write a number and a unit in quotes, like "1.5 {unit}"')
    number, spelling = match.groups()
    if spelling not in spellings:
        raise UnitError(f"{text!r} has {f'unit {spelling!r}' if spelling else 'no unit'}; allowed: {allowed}")
    value = float(number) * spellings[spelling]
    if not math.isfinite(value):
        raise UnitError(f"{text!r} is too large")
    return value
