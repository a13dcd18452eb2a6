"""What varies in a campaign: a value of the scenario, alone or together with others."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..toml_tables import Place, Reader, choice, item, read_list, read_table, text, whole

Written = str | float | int
"""A value as a scenario file has it: "0.1 g", 5, "joint"."""

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def _read_written(value: Any, place: Place) -> Written:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise place.error(f"{value!r} is not a quantity, a number or a name")
    return value


_read_values = read_list(_read_written)


def _read_also(values: Any, place: Place) -> dict[str, tuple[Written, ...]]:
    if not isinstance(values, dict):
        raise place.error("must be a table of dotted keys, in quotes, with lists")
    return {key: _read_values(value, place.at(key)) for key, value in values.items()}


def number_of(written: Written) -> tuple[float, str] | None:
    """Return number and unit, as written; None for what is a name."""
    if isinstance(written, str):
        match = _QUANTITY.fullmatch(written)
        return (float(match[1]), match[2]) if match else None
    return float(written), ""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """[[vary]]: an axis of a campaign.

    `values` are taken as they are; between the two of `range` there are `steps` in a grid, and any number in other
    designs.
    """

    key: str = text()
    """Dotted, as for --set."""
    name: str = text("")
    """In words, for the map."""
    values: tuple[Written, ...] = item(_read_values, default=())
    range: tuple[Written, ...] = item(_read_values, default=())
    steps: int | None = whole(None, least=2, greatest=10**6)
    scale: str = choice("linear", "log", default="linear")
    also: Mapping[str, tuple[Written, ...]] = item(_read_also, default=())
    """Keys that go with it, each with as many values as the axis itself gives."""
    unit: str = field(default="", init=False)
    """Of its numbers, as written."""

    def __post_init__(self) -> None:
        if bool(self.values) == bool(self.range):
            raise ValueError(f"{self.key}: give either values or a range")
        object.__setattr__(self, "also", dict(self.also))
        given = self.values or self.range
        for key, values in self.also.items():
            if len(values) != len(given):
                raise ValueError(f"also: {key} has {len(values)} values and {self.key} {len(given)}")
        if self.range:
            for key, values in self._given().items():
                _check_range(key, values, self.scale)
        units = {number[1] for value in given if (number := number_of(value))}
        if self.is_number and len(units) > 1:
            raise ValueError(f"{self.key}: its values have different units: {', '.join(sorted(units))}")
        object.__setattr__(self, "unit", units.pop() if self.is_number else "")

    def check(self, gridded: bool) -> None:
        """Raise ValueError where it does not suit a design."""
        if self.range and gridded and self.steps is None:
            raise ValueError(f"{self.key}: steps: how many values a grid has between those of range is missing")
        if self.steps is not None and not (self.range and gridded):
            raise ValueError(f"{self.key}: steps are of a range in a grid; remove them")

    @property
    def keys(self) -> tuple[str, ...]:
        """All that it sets."""
        return (self.key, *self.also)

    @property
    def size(self) -> int:
        """Values in a grid."""
        return len(self.values) or self.steps or 0

    @property
    def is_number(self) -> bool:
        """Whether all its values are numbers with or without a unit, or names."""
        return all(number_of(value) is not None for value in self.values or self.range)

    @property
    def label(self) -> str:
        """For people, without the unit."""
        return self.name or self.key

    def at(self, position: float) -> dict[str, Written]:
        """Return what is set at a position from 0 to 1."""
        if self.values:
            index = min(int(position * len(self.values)), len(self.values) - 1)
            return {key: values[index] for key, values in self._given().items()}
        return {key: _between(values, position, self.scale) for key, values in self._given().items()}

    def of_grid(self, index: int) -> dict[str, Written]:
        """Return what is set by value `index` of a grid."""
        if self.values:
            return {key: values[index] for key, values in self._given().items()}
        return self.at(index / (self.size - 1))

    def column(self, point: Mapping[str, Written]) -> float | str:
        """Return what a row has of it."""
        number = number_of(point[self.key])
        return number[0] if self.is_number and number else str(point[self.key])

    def _given(self) -> dict[str, tuple[Written, ...]]:
        return {self.key: self.values or self.range, **self.also}


def _check_range(key: str, values: tuple[Written, ...], scale: str) -> None:
    numbers = [number_of(value) for value in values]
    if len(numbers) != 2 or numbers[0] is None or numbers[1] is None or numbers[0][1] != numbers[1][1]:
        raise ValueError(f"{key}: a range has two quantities in the same unit, from and to")
    if scale == "log" and not (numbers[0][0] > 0.0 and numbers[1][0] > 0.0):
        raise ValueError(f"{key}: a logarithmic range has two values above 0")


def _between(ends: tuple[Written, ...], position: float, scale: str) -> Written:
    """At a position from 0 to 1 between the ends, to twelve digits."""
    first, last = number_of(ends[0]), number_of(ends[1])
    if first is None or last is None:
        raise ValueError("not a range of numbers")
    a, b = first[0], last[0]
    value = a * (b / a) ** position if scale == "log" else a + (b - a) * position
    unit = first[1]
    return f"{value:.12g} {unit}" if unit else float(f"{value:.12g}")


read_axis: Reader = read_table(Axis)
