"""Tables that commands print, and the same rows as JSON."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from ..runtime.files import json_text, write_text
from ..runtime.provenance import provenance
from .layout import UNLIMITED, terminal_width, wrapped

if TYPE_CHECKING:
    from .table_layout import Column

Cell = str | float | bool | None
Row = Mapping[str, Cell]
Tables = Mapping[str, Sequence[Row]]
"""Rows by the title of their table; the keys of its first row are the columns. Titles and columns say the units."""


def add_json_option(parser: argparse._ActionsContainer) -> None:
    """Give a command the option --json FILE, for print_tables()."""
    parser.add_argument(
        "--json",
        metavar="FILE",
        help="also write what is printed to FILE, as JSON: {title: [row, …], provenance: …}; - is standard output, and "
        "what is printed goes to standard error",
    )


def print_tables(
    tables: Tables, json_file: str | None = None, digits: int = 4, inputs: Iterable[str | os.PathLike[str]] = ()
) -> None:
    """Print the tables, numbers with so many `digits`; raise LeverError.

    With `json_file` also write them there, and that they are from the files `inputs`.

    On a terminal they fit its width, and a table of one row stands upright; elsewhere a row is a line.
    """
    from .table_layout import table_lines, upright_lines

    if json_file is not None:
        write_json(json_file, tables, inputs)
    width = terminal_width()
    for title, rows in tables.items():
        if rows:
            columns = _columns(rows, digits)
            print(*wrapped(title, width), sep="\n")
            stands = len(rows) == 1 and width < UNLIMITED
            lines = upright_lines(columns, width) if stands else table_lines(columns, width)
            print(*lines, "", sep="\n")
        else:
            print(*wrapped(f"{title}: none", width), "", sep="\n")


def _columns(rows: Sequence[Row], digits: int) -> list[Column]:
    from .table_layout import Column, is_prose

    columns: list[Column] = []
    for name in rows[0]:
        cells = [_text(row[name], digits) for row in rows]
        is_number = all(_is_number(row[name]) or row[name] is None for row in rows)
        columns.append(Column(name, cells, is_number, bool(columns) and not is_number and is_prose(cells)))
    return columns


def write_json(path: str, tables: Tables, inputs: Iterable[str | os.PathLike[str]] = ()) -> None:
    """Write the tables as {title: [row, …]}, and their provenance; NaN and infinity become null. Raise LeverError."""
    rows = {title: [_json_row(row) for row in rows] for title, rows in tables.items()}
    content = {**rows, "provenance": provenance(inputs).content()}
    write_text(path, json_text(content))


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _text(cell: Cell, digits: int) -> str:
    if cell is None:
        return ""
    if not isinstance(cell, float):
        return " ".join(str(cell).split("\n"))
    text = f"{cell:.{digits}g}"
    return f"{cell:.0f}" if "e+" in text and abs(cell) < 1e9 else text


def _json_row(row: Row) -> Row:
    return {key: None if isinstance(cell, float) and not math.isfinite(cell) else cell for key, cell in row.items()}
