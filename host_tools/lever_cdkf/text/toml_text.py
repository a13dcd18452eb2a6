"""TOML, for all that read a file of it: mappings, scenarios, aircraft, campaigns."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from ..errors import LeverError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MOST_NESTED = 50
"""Tables and lists within one another; what is read from them may recurse."""


class TomlError(LeverError):
    """What is not TOML; the text says why."""


class NestedError(TomlError):
    """What is nested too deeply."""


def parse(content: bytes) -> dict[str, Any]:
    """Return the table that a file holds. Raise TomlError."""
    try:
        table = tomllib.loads(content.decode("utf-8"))
    except ValueError as error:  # also of text that is not UTF-8, and of a whole number with too many digits
        raise TomlError(f"not TOML: {error}") from None
    except RecursionError:
        table = None
    if table is None or _is_deep(table):
        raise NestedError(f"its tables or lists are nested too deeply (more than {MOST_NESTED})")
    return table


def _is_deep(table: dict[str, Any]) -> bool:
    level: list[Any] = [table]
    for _ in range(MOST_NESTED):
        level = [each for outer in level for each in _items(outer) if isinstance(each, (dict, list))]
    return bool(level)


def _items(nested: Any) -> Iterable[Any]:
    return nested.values() if isinstance(nested, dict) else nested
