"""Tables as text in so many columns of a terminal. No number and no word is ever cut."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count, zip_longest

from .layout import text_width, words, wrapped

_PROSE = 32
"""A column of text is wrapped to no less; if it has less, it goes beneath the row."""
_NAME_LINES = 3
_INDENT = "    "


@dataclass(frozen=True)
class Column:
    """A column of a table as text."""

    name: str
    cells: Sequence[str]
    is_number: bool
    """Stands to the right, and is not wrapped."""

    @property
    def natural(self) -> int:
        """The columns that it takes on one line."""
        return max(map(text_width, (self.name, *self.cells)))

    @property
    def least(self) -> int:
        """The columns that it needs: its name is wrapped, text as far as it can be read well."""
        longest = max(map(text_width, words(self.name)))
        name = next(width for width in count(longest) if len(wrapped(self.name, width)) <= _NAME_LINES)
        cells = max(map(text_width, self.cells))
        if not self.is_number:
            cells = max(min(_PROSE, cells), *(text_width(word) for cell in self.cells for word in words(cell)), 0)
        return max(name, cells)


def table_lines(columns: Sequence[Column], width: int) -> list[str]:
    """Return a table in `width` columns.

    What is too wide has its names and texts wrapped; then texts at the end stand beneath their rows; then it is folded
    into blocks that repeat the first column; and at last each row stands upright.
    """
    for beside in range(len(columns), 0, -1):
        widths = _widths(columns[:beside], width)
        if widths:
            return list(_block(columns[:beside], widths, columns[beside:], width))
        if columns[beside - 1].is_number or columns[beside - 1].natural <= _PROSE:
            break
    keys = _keys(columns)
    blocks = _blocks(columns[:keys], columns[keys:], width)
    if blocks:
        return [line for block in blocks for line in ("", *table_lines(block, width))][1:]
    rows = range(len(columns[0].cells))
    return [line for row in rows for line in ("", *upright_lines(columns, row, width))][1:]


def upright_lines(columns: Sequence[Column], row: int, width: int) -> Iterator[str]:
    """Yield a row as lines of name, value and unit, which is in brackets at the end of the name."""
    named = [re.fullmatch(r"(.*?)(?: \[(.*)\])?", column.name) for column in columns]
    entries = [
        (match[1], f"{cell} {match[2]}" if cell and match[2] not in (None, "1") else cell or "-")
        for match, cell in zip(named, (column.cells[row] for column in columns), strict=True)
        if match is not None
    ]
    left = max(text_width(name) for name, _ in entries)
    needed = max(text_width(word) for _, value in entries for word in words(value))
    if left + needed + 4 > width:
        for name, value in entries:
            yield from (f"  {name}", *(f"{_INDENT}{line}" for line in wrapped(value, width - len(_INDENT))))
        return
    for name, value in entries:
        first, *others = wrapped(value, width - left - 4)
        yield f"  {name}{' ' * (left - text_width(name))}  {first}"
        yield from (f"  {' ' * left}  {other}" for other in others)


def _widths(columns: Sequence[Column], width: int) -> list[int] | None:
    """Return the widths of the columns beside each other; None if there is no room for them."""
    gaps = 2 * (len(columns) - 1)
    widths = [column.least for column in columns]
    if sum(widths) + gaps > width:
        return None
    spare = width - sum(widths) - gaps
    for i, column in sorted(enumerate(columns), key=lambda each: each[1].is_number):
        more = min(spare, column.natural - widths[i])
        widths[i] += more
        spare -= more
    return widths


def _block(columns: Sequence[Column], widths: Sequence[int], beneath: Sequence[Column], width: int) -> Iterator[str]:
    head = [wrapped(column.name, size) for column, size in zip(columns, widths, strict=True)]
    height = max(map(len, head))
    yield from _row([[""] * (height - len(lines)) + lines for lines in head], columns, widths)
    yield from (f"{_INDENT}{column.name}" for column in beneath)
    yield "-" * min(width, sum(widths) + 2 * (len(widths) - 1))
    for i in range(len(columns[0].cells)):
        cells = [wrapped(column.cells[i], size) for column, size in zip(columns, widths, strict=True)]
        yield from _row(cells, columns, widths)
        for column in beneath:
            yield from (f"{_INDENT}{line}" for line in wrapped(column.cells[i], width - len(_INDENT)) if line)


def _row(cells: Sequence[Sequence[str]], columns: Sequence[Column], widths: Sequence[int]) -> Iterator[str]:
    for line in zip_longest(*cells, fillvalue=""):
        parts = []
        for text, column, size in zip(line, columns, widths, strict=True):
            blank = " " * (size - text_width(text))
            parts.append(blank + text if column.is_number else text + blank)
        yield "  ".join(parts).rstrip()


def _keys(columns: Sequence[Column]) -> int:
    """Return how many columns at the left tell the rows apart; 1 if that takes more than two columns."""
    first, *others = (column.cells for column in columns[:2])
    return 2 if len(set(first)) < len(first) == len(set(zip(first, *others, strict=True))) else 1


def _blocks(keys: Sequence[Column], others: Sequence[Column], width: int) -> list[list[Column]]:
    """Return columns that fit beside each other, each block with the keys in front; none if one alone does not."""
    blocks: list[list[Column]] = []
    for column in others:
        if blocks and _widths([*blocks[-1], column], width):
            blocks[-1].append(column)
        elif _widths([*keys, column], width):
            blocks.append([*keys, column])
        else:
            return []
    return blocks
