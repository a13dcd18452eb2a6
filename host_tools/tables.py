"""Tables that commands print, and the same rows as JSON."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence

from .files import write_text

Cell = str | float | bool | None
Row = Mapping[str, Cell]
Tables = Mapping[str, Sequence[Row]]
"""Rows by the title of their table; the keys of its first row are the columns. Titles and columns say the units."""

_PIPE_WIDTH = 100_000  # not a terminal: no line is folded


def add_json_option(parser: argparse._ActionsContainer) -> None:
    """Gives a command the option --json FILE, for print_tables()."""
    parser.add_argument("--json", metavar="FILE", help="also write what is printed to FILE, as JSON: {title: [row, …]}")


def print_tables(tables: Tables, json_file: str | None = None) -> None:
    """Prints the tables, and with `json_file` also writes them there. Raises LeverError."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    if json_file is not None:
        write_json(json_file, tables)
    console = Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, highlight=False)
    for title, rows in tables.items():
        if not rows:
            console.print(_literal(f"{title}: none"))
            continue
        table = Table(title=_literal(title), title_justify="left", box=box.SIMPLE_HEAD)
        for column in rows[0]:
            is_number = all(_is_number(row[column]) or row[column] is None for row in rows)
            table.add_column(_literal(column), justify="right" if is_number else "left")
        for row in rows:
            table.add_row(*(_text(cell) for cell in row.values()))
        console.print(table)


def write_json(path: str, tables: Tables) -> None:
    """Writes the tables as {title: [row, …]}; NaN and infinity become null. Raises LeverError."""
    content = {title: [_json_row(row) for row in rows] for title, rows in tables.items()}
    write_text(path, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _text(cell: Cell) -> str:
    if cell is None:
        return ""
    return f"{cell:.6g}" if isinstance(cell, float) else _literal(str(cell))


def _literal(text: str) -> str:
    """Text that rich prints as it is: a unit in brackets is not one of its styles."""
    return text.replace("[", "\\[")


def _json_row(row: Row) -> Row:
    return {key: None if isinstance(cell, float) and not math.isfinite(cell) else cell for key, cell in row.items()}
