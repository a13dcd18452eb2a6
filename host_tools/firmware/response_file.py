"""The frequency response of a helicopter from a file, as a flight test or another simulation gives it.

CSV with a row a frequency, rising: frequency [Hz], real and imaginary part of the cabin's vertical acceleration over
the lever's angle [(m/s²)/rad], with gearing, delays and actuator. A first row of names and lines that begin with # are
passed over.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from ..errors import LeverError


class ResponseTable(NamedTuple):
    """A frequency response."""

    frequency: list[float]
    """[Hz], rising."""
    response: list[complex]
    """[(m/s²)/rad]"""


def read_response(path: str | Path) -> ResponseTable:
    """The table in a file. Raises LeverError."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeError) as error:
        raise LeverError(f"{path}: {getattr(error, 'strerror', None) or 'not text in UTF-8'}") from None
    table = ResponseTable([], [])
    for number, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in line.split(",")]
        if line.startswith("#") or not line.strip() or (not table.frequency and not _is_number(cells[0])):
            continue
        if len(cells) != 3 or not all(map(_is_number, cells)):
            raise LeverError(f"{path}: line {number}: must be three numbers: frequency [Hz], real, imaginary")
        frequency, real, imaginary = map(float, cells)
        if frequency <= (table.frequency[-1] if table.frequency else 0.0):
            raise LeverError(f"{path}: line {number}: the frequencies must rise, from above 0")
        table.frequency.append(frequency)
        table.response.append(complex(real, imaginary))
    if len(table.frequency) < 3:
        raise LeverError(f"{path}: {len(table.frequency)} frequencies; a response has at least 3")
    return table


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False
