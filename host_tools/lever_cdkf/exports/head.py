"""What every file says before its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from .columns import Column


@dataclass(frozen=True)
class Head:
    """Of all files of a run."""

    columns: list[Column]
    start_us: int
    """Of time_s = 0 [us since 1970]; next to 0 where it is not known, as in a simulation."""
    created: datetime
    properties: Mapping[str, str]
    """Provenance, and the date of the start where it is known."""
