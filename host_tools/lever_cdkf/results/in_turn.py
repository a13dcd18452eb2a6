"""Puts side by side what a message sends in turn, from the columns of a trace: a frequency or a statistic a frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray

_THINNED = 0.5  # [s]


class InTurn:
    """Keeps what belongs to each key, twice a second at most, of samples as they come."""

    def __init__(self, columns: Sequence[str], keys: FloatArray) -> None:
        """`columns` of the trace, of which the first says what the others belong to: one of the keys, from 0 to 15."""
        self._columns = ("time_s", *columns)
        self._keys = keys
        self._parts: list[FloatArray] = []

    def add(self, trace: Mapping[str, NDArray[Any]]) -> None:
        """Further samples; a trace without these columns leaves nothing."""
        if not set(self._columns) <= trace.keys():
            return
        rows = np.column_stack([np.asarray(trace[name], dtype=np.float64) for name in self._columns])
        rows = rows[np.isin(rows[:, 1], self._keys)][::-1]  # the last of each is kept
        slot = np.floor(rows[:, 0] / _THINNED) * 16.0 + rows[:, 1]
        self._parts.append(rows[np.unique(slot, return_index=True)[1]])

    def latest(self, time: FloatArray) -> FloatArray:
        """Return the columns after the first, (times, keys, columns), as last sent before each time [s].

        NaN before the first, and where it was not available.
        """
        rows = np.concatenate([np.full((1, len(self._columns)), np.nan), *self._parts])
        latest = np.full((len(time), len(self._keys), len(self._columns) - 2), np.nan)
        for index, key in enumerate(self._keys):
            own = rows[rows[:, 1] == key]
            last = np.searchsorted(own[:, 0], time, side="right") - 1
            latest[last >= 0, index] = own[last[last >= 0], 2:]
        return latest
