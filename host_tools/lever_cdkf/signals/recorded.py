"""A signal as a log or file has it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..numeric.arrays import FloatArray


@dataclass(frozen=True)
class Signal:
    """Values with the time of each."""

    name: str
    time: FloatArray
    """[s]"""
    values: FloatArray
    """NaN: recorded, but not valid."""
    unit: str = ""
    """As it is written there; empty without one."""
    words: str = ""
    """What the database says of it."""
    time_column: str = ""
    """Of a file of columns: the one with its times."""
    time_unit: str = ""
    """In which that column is, as it was said or taken; empty for dates."""
    notes: tuple[str, ...] = ()
    """What its reader had to decide, a sentence each, for the user to see."""

    @cached_property
    def period(self) -> float:
        """Usual time between two values [s]; infinite with fewer than two."""
        steps = np.diff(self.time)
        steps = steps[steps > 0.0]
        if not len(steps):
            return float("inf")
        middle = np.median(steps)
        usual = steps[(steps > 0.5 * middle) & (steps < 1.5 * middle)]  # without gaps; jitter does not move their mean
        return float(np.mean(usual))

    def changes(self) -> bool:
        """Return whether it has more than one value."""
        present = self.values[np.isfinite(self.values)]
        return len(present) > 0 and bool((present != present[0]).any())

    def between(self, start: float, end: float) -> Signal:
        """Return the part from `start` to `end` [s]."""
        inside = (self.time >= start) & (self.time < end)
        return replace(self, time=self.time[inside], values=self.values[inside])


def notes_of(signals: Iterable[Signal]) -> list[str]:
    """Return the notes of all signals, each once."""
    return list(dict.fromkeys(note for each in signals for note in each.notes))


def ordered(signal: Signal) -> tuple[Signal, int]:
    """Without values that are not later than all before them, and how many those were."""
    latest = np.maximum.accumulate(signal.time) if len(signal.time) else signal.time
    later = np.diff(latest, prepend=-np.inf) > 0.0
    return replace(signal, time=signal.time[later], values=signal.values[later]), int(len(later) - later.sum())
