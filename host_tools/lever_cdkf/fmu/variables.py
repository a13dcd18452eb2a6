"""The variables of an FMU, from the tables that its C reads as well."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_ROW = re.compile(
    r'^FMU_VARIABLE\((?P<name>\w+), (?P<type>\w+), (?P<role>\w+), "(?P<unit>[^"]*)", (?P<start>[^,]+), '
    r'"(?P<meaning>[^"]*)"\)$',
    re.MULTILINE,
)


@dataclass(frozen=True)
class Variable:
    """One variable; its value reference is its place among all."""

    name: str
    type: str
    """FLOAT64, INT64, BOOLEAN, ENUMERATION, BINARY or CLOCK, as in enum fmu_type."""
    role: str
    """INDEPENDENT, STRUCTURALPARAMETER, PARAMETER, INPUT or OUTPUT, as in enum fmu_role."""
    unit: str
    """"1" without one."""
    start: float
    """Of inputs and parameters."""
    meaning: str
    least: float | None = None
    greatest: float | None = None
    enumeration: str = ""
    """Of type ENUMERATION: the enum of lever_cdkf.h."""
    mime_type: str = ""
    """Of type BINARY."""
    clock: str = ""
    """Of type BINARY: the variable at whose ticks it is got or set."""


def read_table(text: str) -> Iterator[Variable]:
    """Yield the rows FMU_VARIABLE(name, type, role, unit, start, meaning) of a .def file."""
    for row in _ROW.finditer(text):
        is_enumeration = row["type"] == "ENUMERATION"
        yield Variable(
            name=row["name"],
            type=row["type"],
            role=row["role"],
            unit="1" if is_enumeration else row["unit"],
            start=float(row["start"]),
            meaning=row["meaning"],
            enumeration=row["unit"] if is_enumeration else "",
        )
