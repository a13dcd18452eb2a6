"""Tables by Rich in so many columns of a terminal. No number is cut or folded: a wide table becomes several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from .layout import words, wrapped

_PROSE = 32
"""Wider text is prose, which is folded, to no less than this, or stands beneath its row."""
_HEADING_LINES = 3
_INDENT = "    "


@dataclass(frozen=True)
class Column:
    """A column of a table as text."""

    name: str
    cells: Sequence[str]
    is_number: bool
    """Stands to the right."""
    is_prose: bool

    def least(self, folded: bool) -> int:
        """Return the columns of a terminal that it needs, with its name on one line or folded."""
        name = cell_len(self.name)
        if folded:
            name = max([-(-name // _HEADING_LINES), *map(cell_len, words(self.name))])
        whole = [word for cell in self.cells for word in words(cell)] if self.is_prose else self.cells
        return max([name, _PROSE if self.is_prose else 0, *map(cell_len, whole)])


def is_prose(cells: Sequence[str]) -> bool:
    """Return whether texts are so wide that they are better folded, or stand beneath their rows."""
    return max(map(cell_len, cells)) > _PROSE


def table_lines(columns: Sequence[Column], width: int) -> list[str]:
    """Return a table in `width` columns of a terminal.

    Where it is too wide, its headings and prose are folded; then prose stands beneath the rows; and at last it becomes
    several tables that repeat the first columns.
    """
    if _fit(columns, width):
        return _drawn(columns, width)
    keys = list(columns[: _keys(columns)])
    blocks = [keys]
    for column in columns[len(keys) :]:
        if column.is_prose:
            continue
        if blocks[-1] == keys or _fit([*blocks[-1], column], width):
            blocks[-1] = [*blocks[-1], column]
        else:
            blocks.append([*keys, column])
    *others, last = (_drawn(block, width) for block in blocks)
    beneath = [column for column in columns if column.is_prose]
    head = len(last) - len(keys[0].cells)
    lines = [line for block in others for line in (*block, "")] + last[: head - 1]
    lines += [*(f"{_INDENT}{column.name}" for column in beneath), last[head - 1]]
    for i, line in enumerate(last[head:]):
        texts = (wrapped(column.cells[i], width - len(_INDENT)) for column in beneath if column.cells[i])
        lines += [line, *(f"{_INDENT}{part}" for text in texts for part in text)]
    return lines


def upright_lines(columns: Sequence[Column], width: int) -> list[str]:
    """Return the first row as lines of name, value and unit, which is in brackets at the end of the name."""
    names, values = [], []
    for column in columns:
        name, _, unit = column.name.removesuffix("]").partition(" [")
        names.append(f"  {name}")
        values.append(
            f"{column.cells[0]} {unit}" if column.cells[0] and unit not in ("", "1") else column.cells[0] or "-"
        )
    both = [Column("", names, False, False), Column("", values, False, is_prose(values))]
    return _drawn(both, width)[2:]


def _fit(columns: Sequence[Column], width: int, folded: bool = True) -> bool:
    return sum(column.least(folded) + 2 for column in columns) - 2 <= width


def _keys(columns: Sequence[Column]) -> int:
    """Return how many columns at the left tell the rows apart; 1 if that takes more than two columns."""
    first, *others = (column.cells for column in columns[:2])
    return 2 if len(set(first)) < len(first) == len(set(zip(first, *others, strict=True))) else 1


def _drawn(columns: Sequence[Column], width: int) -> list[str]:
    """Return what Rich draws; a line that needs more than `width` has it."""
    shown = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    folded = not _fit(columns, width, folded=False)
    for column in columns:
        least = column.least(folded)
        shown.add_column(
            Text("\n".join(wrapped(column.name, least))),
            justify="right" if column.is_number else "left",
            overflow="fold",
            min_width=least,
            max_width=None if column.is_prose else least,
        )
    for row in zip(
        *([Text(cell, no_wrap=not column.is_prose) for cell in column.cells] for column in columns), strict=True
    ):
        shown.add_row(*row)
    console = Console(width=width, color_system=None)
    with console.capture() as captured:
        console.print(shown, crop=False)
    return [line.rstrip() for line in captured.get().splitlines()]
