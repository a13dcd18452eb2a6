"""Tables as text: CSV with any delimiter, a decimal point or comma, a line of names and perhaps one of units."""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import re
import zlib
from itertools import islice

import numpy as np

from ..errors import LeverError
from ..numeric.arrays import Array
from .units import is_unit, normal, split_name

UTF_8, WESTERN = "utf-8-sig", "cp1252"
"""Encodings: the second is that of spreadsheets in Western Europe and America."""

_BLOCK = 1 << 20
_DELIMITERS = ",;\t| "
_LOOKED_AT = 200
"""Lines at the beginning, among which the header ends."""
_NOTHING = re.compile(r"|-|n/?a|nan|null|none|inf|-inf", re.IGNORECASE)


def read(path: str) -> dict[str, tuple[Array, str]]:
    """Return values and unit of each column by its name. Raise LeverError."""
    text = _text(path)
    lines = text.splitlines()
    delimiter, comma, first = _layout(lines, path)
    names, units = _header(lines, delimiter, first, path)
    body = "\n".join(lines[first:])
    if comma:
        body = re.sub(r"(?<=\d),(?=\d)", ".", body)
    numbers = _numbers(body, delimiter, len(names), path, first)
    columns: dict[str, tuple[Array, str]] = {}
    for index, (name, unit) in enumerate(zip(names, units, strict=True)):
        if name and name not in columns:
            columns[name] = (numbers[:, index], unit)
    return columns


def has_frames(path: str) -> bool:
    """Return whether a CSV is a log of frames as python-can writes it."""
    return _start(path)[0].startswith("timestamp,arbitration_id,")


def is_text_table(path: str) -> bool:
    """Return whether a text is a table with a header, and no log."""
    try:
        _layout(_start(path), path)
    except LeverError:
        return False
    return not _start(path)[0].startswith("(")


def _open(path: str) -> gzip.GzipFile | io.BufferedReader:
    """Return the bytes of a text that may be compressed."""
    with open(path, "rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
    return gzip.open(path, "rb") if packed else open(path, "rb")


def encoding_of(path: str) -> str:
    """Return UTF_8, or WESTERN for a text that is not."""
    decoder = codecs.getincrementaldecoder(UTF_8)()
    try:
        with _open(path) as file:
            while block := file.read(_BLOCK):
                decoder.decode(block)
            decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return WESTERN
    return UTF_8


def _start(path: str) -> list[str]:
    try:
        with _open(path) as file:
            start = b"".join(islice(file, _LOOKED_AT))
    except (OSError, EOFError, zlib.error) as error:
        raise LeverError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    return _decoded(start).splitlines() or [""]


def _text(path: str) -> str:
    with _open(path) as file:
        return _decoded(file.read())


def _decoded(text: bytes) -> str:
    try:
        return text.decode(UTF_8)
    except UnicodeDecodeError:
        return text.decode(WESTERN, errors="replace")


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return [each.strip() for each in next(csv.reader([line], delimiter=delimiter), [])]


def _number(text: str, comma: bool = False) -> float | None:
    if comma:
        text = text.replace(",", ".")
    try:
        return float(text)
    except ValueError:
        return float("nan") if _NOTHING.fullmatch(text.strip()) else None


def _layout(lines: list[str], path: str) -> tuple[str, bool, int]:
    """Return the delimiter, whether decimals have a comma, and the first line of numbers. Raise LeverError."""
    best: tuple[int, str, bool, int] = (0, "", False, 0)
    for comma in (False, True):
        for delimiter in _DELIMITERS:
            if not (comma and delimiter == ","):
                score, first = _first_row(lines[:_LOOKED_AT], delimiter, comma)
                if score > best[0]:
                    best = (score, delimiter, comma, first)
    if not best[0]:
        raise LeverError(f"{path}: no table of numbers: it needs a line of names, and at least two columns below it")
    return best[1:]


def _first_row(lines: list[str], delimiter: str, comma: bool) -> tuple[int, int]:
    """Return how well the lines fit, 0: not at all, and which is the first of several with as many fields.

    Those fields are mostly numbers.
    """
    rows = [_fields(line, delimiter) for line in lines]
    numbered = [[_number(each, comma) for each in row] for row in rows]
    for index, (row, values) in enumerate(zip(rows, numbered, strict=True)):
        numbers = sum(each is not None and each == each for each in values)
        text = sum(each is None for each in values)
        if numbers >= 2 and numbers > 2 * text:
            after = [each for each in rows[index + 1 : index + 6] if any(each)]
            if after and all(len(each) == len(row) for each in after):
                while index and len(rows[index - 1]) == len(row) and _says_little(numbered[index - 1]):
                    index -= 1
                return numbers - 2 * text, index
    return 0, 0


def _says_little(values: list[float | None]) -> bool:
    """Return whether it is a row of a time, and nothing known at it."""
    return None not in values and any(value == value for value in values)


def _header(lines: list[str], delimiter: str, first: int, path: str) -> tuple[list[str], list[str]]:
    """Return names and units of the columns. Raise LeverError."""
    width = len(_fields(lines[first], delimiter))
    above = [_fields(line.lstrip("#% "), delimiter) for line in lines[:first]]
    named = [row for row in above if len(row) == width]
    if not named and above and len(above[-1]) > 1:
        raise LeverError(
            f"{path}: line {first} has {len(above[-1])} names, and the line below it {width} numbers: "
            "each column needs both"
        )
    if not named:
        raise LeverError(f"{path}: its columns have no names: put a line with a name for each above the numbers")
    above = named
    labels, units = above[-1], [""] * width
    if len(above) > 1 and sum(is_unit(normal(each.strip("[]()"))) for each in above[-1]) >= width / 2:
        labels, units = above[-2], [each.strip("[]() ") for each in above[-1]]
    split = [split_name(label) for label in labels]
    return [name for name, _ in split], [unit or own for unit, (_, own) in zip(units, split, strict=True)]


def _numbers(body: str, delimiter: str, width: int, path: str, first: int) -> Array:
    """Return the numbers below the header; NaN for what is none. Raise LeverError."""
    separator = None if delimiter == " " else delimiter
    try:
        return np.loadtxt(io.StringIO(body), delimiter=separator, ndmin=2, comments=None)
    except ValueError:
        pass  # with fields that are empty, or text: slower
    rows = csv.reader(io.StringIO(body), delimiter=delimiter, skipinitialspace=True)
    taken = []
    for row in rows:
        if row and len(row) == width:
            taken.append([np.nan if (value := _number(each)) is None else value for each in row])
        elif any(row) and len(taken) and rows.line_num < body.count("\n"):
            raise LeverError(f"{path}: line {first + rows.line_num} has {len(row)} fields, those above it {width}")
    if not taken:
        raise LeverError(f"{path}: no row of numbers below its header")
    return np.array(taken)
