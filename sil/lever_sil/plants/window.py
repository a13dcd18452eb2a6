"""When something acts: the keys `start` and `end` of many tables of a scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lever_cdkf.numeric.arrays import BoolArray, FloatArray

from ..toml_tables import quantity


@dataclass(frozen=True, kw_only=True)
class Window:
    """From `start` (included) to `end` (excluded) [s]."""

    start: float = quantity("s", 0.0, least=0.0)
    end: float = quantity("s", math.inf, above=0.0)

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise ValueError(f"start {self.start:g} s is not before end {self.end:g} s")

    def contains(self, time: FloatArray) -> BoolArray:
        """Return which of the times `time` [s] are in it."""
        inside: BoolArray = (time >= self.start) & (time < self.end)
        return inside
