"""From a TOML table to a frozen dataclass, with every value checked and every error naming file, key and remedy.

A dataclass says by its fields what a table may hold: each field is made by quantity(), whole(), text(), choice(),
table() or tables(), which put a reader into the field's metadata. read() walks the fields; keys that no field names are
refused.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from lever_cdkf.errors import LeverError
from lever_cdkf.text import toml_text, units
from lever_cdkf.text.suggestions import did_you_mean

SIGNAL = "signal"
"""Unit of a field that is the unit of whatever the table describes: m/s^2 under [[base]], kg under pilot.m_p."""

T = TypeVar("T")


class ScenarioError(LeverError):
    """A scenario that cannot be used; the text is one line: file, key, what is wrong, what is allowed."""


@dataclass(frozen=True)
class Place:
    """Where in which file a value stands, and the unit that SIGNAL means there."""

    file: str
    path: str = ""
    signal: str = "1"

    def at(self, key: str | int, signal: str | None = None) -> Place:
        """Return the place of `key` (name or list index) inside this one."""
        step = f"[{key}]" if isinstance(key, int) else f".{key}"
        path = f"{self.path}{step}".removeprefix(".")
        return Place(self.file, path, self.signal if signal is None else signal)

    def error(self, message: str) -> ScenarioError:
        """Return an error that names file and key."""
        return ScenarioError(f"{self.file}: {self.path}: {message}" if self.path else f"{self.file}: {message}")

    def check_table(self, values: Any, known: Collection[str]) -> None:
        """Raise ScenarioError unless `values` is a table, and all its keys are known."""
        if not isinstance(values, dict):
            raise self.error(f"{values!r} is not a table")
        for key in values:
            if key not in known:
                hint = did_you_mean(key, known, f"allowed: {', '.join(known)}")
                raise self.error(f"unknown key {key!r}; {hint}")


@dataclass(frozen=True)
class Shelf:
    """The .toml files of one kind that come with the package, found by name; those of others are found by path."""

    kind: str
    """In errors."""
    package: str
    folder: str = ""

    def names(self) -> list[str]:
        """Return the names of the files."""
        names = (entry.name for entry in self._files().iterdir())
        return sorted(name.removesuffix(_ENDING) for name in names if name.endswith(_ENDING))

    def content(self, name_or_path: str) -> bytes:
        """Return the content of the file of that name or path (ending in .toml). Raise ScenarioError."""
        path, names = Path(name_or_path), self.names()
        if name_or_path in names:
            content: bytes = (self._files() / f"{name_or_path}{_ENDING}").read_bytes()
            return content
        if path.suffix == _ENDING and path.is_file():
            return path.read_bytes()
        if path.exists():
            what = "a folder" if path.is_dir() else f"no {_ENDING} file"
            raise ScenarioError(f"{path} is {what}: give the {_ENDING} file of one {self.kind}, or {', '.join(names)}")
        if path.suffix == _ENDING:
            raise ScenarioError(f"{path}: no such file")
        hint = did_you_mean(name_or_path, names, f"there are {', '.join(names)}, or give a path to a .toml file")
        raise ScenarioError(f"no {self.kind} {name_or_path!r}; {hint}")

    def _files(self) -> Any:
        package = files(self.package)
        return package / self.folder if self.folder else package


_ENDING = ".toml"


def file_of(name_or_path: str) -> str:
    """Return how errors call the file that Shelf.content() finds."""
    return name_or_path if name_or_path.endswith(_ENDING) else f"{name_or_path}{_ENDING}"


def parse(content: bytes, file: str) -> dict[str, Any]:
    """Return the table that a file holds. Raise ScenarioError."""
    try:
        return toml_text.parse(content)
    except toml_text.TomlError as error:
        raise ScenarioError(f"{file}: {error}") from None


def value_of(written: str) -> Any:
    """Return what KEY=VALUE of a command line gives.

    It is TOML when it is TOML, otherwise a string, so that a shell needs no second quotes.
    """
    try:
        return toml_text.parse(f"value = {written}".encode())["value"]
    except toml_text.NestedError as error:
        raise ScenarioError(f"{written[:20]}...: {error}") from None
    except (toml_text.TomlError, UnicodeEncodeError):
        return written.strip()


Reader = Callable[[Any, Place], Any]
_REQUIRED: Any = dataclasses.MISSING


def _field(reader: Reader, default: Any) -> Any:
    if default is not _REQUIRED and isinstance(default, (list, dict)):
        raise TypeError("use a tuple: a default is shared")
    return dataclasses.field(default=default, metadata={"read": reader})


def read_quantity(unit: str, least: float = -math.inf, greatest: float = math.inf, above: float = -math.inf) -> Reader:
    """Reader of "number unit" within least <= value <= greatest and value > above, all in `unit` (SI, or SIGNAL)."""

    def reader(value: Any, place: Place) -> float:
        si = place.signal if unit == SIGNAL else unit
        try:
            number = units.parse(value, si)
        except units.UnitError as error:
            raise place.error(str(error)) from None
        if not (least <= number <= greatest and number > above):
            limits = [f"above {above:g}"] if above > -math.inf else []
            limits += [f"at least {least:g}"] if least > -math.inf else []
            limits += [f"at most {greatest:g}"] if greatest < math.inf else []
            raise place.error(
                f"{value!r} is out of range; it must be {' and '.join(limits)}{'' if si == '1' else f' {si}'}"
            )
        return number

    return reader


def quantity(unit: str, default: Any = _REQUIRED, **limits: float) -> Any:
    """Return a field that holds a number in the SI `unit`, written with a unit; `limits` as for read_quantity."""
    return _field(read_quantity(unit, **limits), default)


def read_list(reader: Reader) -> Reader:
    """Reader of a list whose every item `reader` reads, as a tuple."""

    def list_reader(value: Any, place: Place) -> tuple[Any, ...]:
        if not isinstance(value, list) or not value:
            raise place.error("must be a list with at least one item")
        return tuple(reader(item, place.at(i)) for i, item in enumerate(value))

    return list_reader


def quantities(unit: str, **limits: float) -> Any:
    """Return a field that holds a tuple of numbers in the SI `unit`."""
    return _field(read_list(read_quantity(unit, **limits)), _REQUIRED)


def read_whole(least: int, greatest: int) -> Reader:
    """Reader of a whole number without a unit (a count, a seed)."""

    def reader(value: Any, place: Place) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= greatest:
            raise place.error(f"{value!r} is not a whole number from {least} to {greatest}")
        return value

    return reader


def whole(default: Any = _REQUIRED, least: int = 0, greatest: int = 2**63 - 1) -> Any:
    """Return a field that holds a whole number."""
    return _field(read_whole(least, greatest), default)


def wholes(least: int, greatest: int) -> Any:
    """Return a field that holds a tuple of whole numbers."""
    return _field(read_list(read_whole(least, greatest)), _REQUIRED)


def text(default: Any = _REQUIRED) -> Any:
    """Return a field that holds a string, folded onto one line."""

    def reader(value: Any, place: Place) -> str:
        if not isinstance(value, str):
            raise place.error(f"{value!r} is not a string")
        return " ".join(value.split())

    return _field(reader, default)


def choice(*options: str, default: Any = _REQUIRED) -> Any:
    """Return a field that holds one of the strings `options`."""

    def reader(value: Any, place: Place) -> str:
        if value not in options:
            raise place.error(f"{value!r} is not known; allowed: {', '.join(options)}")
        return str(value)

    return _field(reader, default)


def item(reader: Reader, signal: str | None = None, default: Any = _REQUIRED) -> Any:
    """Return a field read by `reader`, in which SIGNAL means `signal`."""

    def item_reader(value: Any, place: Place) -> Any:
        return reader(value, dataclasses.replace(place, signal=signal or place.signal))

    return _field(item_reader, default)


def read_table(kind: type[T], **usual: Any) -> Reader:
    """Reader of a table into the dataclass `kind`; `usual` are defaults that differ from those of its fields."""
    return lambda value, place: read(kind, value, place, usual)


def table(kind: type[T]) -> Any:
    """Return a field that holds a nested table.

    A missing one is read as an empty one, so that its own defaults hold.
    """
    return dataclasses.field(default_factory=lambda: kind(), metadata={"read": read_table(kind)})


def read_kind(kinds: Mapping[str, type[Any]], key: str = "kind", default: str | None = None) -> Reader:
    """Reader of a table whose `key` says which of the dataclasses `kinds` it is."""

    def reader(value: Any, place: Place) -> Any:
        kind = value.get(key, default) if isinstance(value, dict) else None
        if not isinstance(kind, str) or kind not in kinds:
            raise place.error(f"must be a table with {key} = one of {', '.join(kinds)}")
        return read(kinds[kind], {name: entry for name, entry in value.items() if name != key}, place)

    return reader


def tables(reader: Reader, signal: str | None = None) -> Any:
    """Return a field that holds a tuple of tables, by default none."""
    return item(read_list(reader), signal, ())


def read(kind: type[T], values: Any, place: Place, usual: Mapping[str, Any] = MappingProxyType({})) -> T:
    """Return the dataclass `kind` from the table `values`, with defaults as for read_table(). Raise ScenarioError."""
    all_fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    fields = {field.name: field for field in all_fields if "read" in field.metadata}
    place.check_table(values, fields)
    read_values = dict(usual)
    for name, field in fields.items():
        if name in values:
            read_values[name] = field.metadata["read"](values[name], place.at(name))
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise place.error(f"key {name!r} is missing")
    try:
        return kind(**read_values)
    except ValueError as error:
        raise place.error(str(error)) from None
