"""A trace of any length reduced, while it comes, to what a page and a summary can hold.

How it is cut into pieces on the way makes no difference: Stretches halve at a fixed number, groups have a fixed size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray

Trace = Mapping[str, FloatArray]
Reduce = Callable[[FloatArray], FloatArray]

MOST = 8192
"""Stretches that are kept, at most."""
_DENSE = ("theta_", "theta_dot_", "z_ddot_", "tau_m_", "dither_", "correction_", "mode")


def _first(rows: FloatArray) -> FloatArray:
    return rows[:, 0]


def _least(rows: FloatArray) -> FloatArray:
    least: FloatArray = np.fmin.reduce(rows, axis=1)
    return least


def _greatest(rows: FloatArray) -> FloatArray:
    greatest: FloatArray = np.fmax.reduce(rows, axis=1)
    return greatest


def _any_bit(rows: FloatArray) -> FloatArray:
    bits = np.bitwise_or.reduce(np.nan_to_num(rows).astype(np.int64), axis=1)
    return np.where(np.isnan(rows).all(axis=1), np.nan, bits)


def _rules(name: str) -> tuple[Reduce, ...]:
    """Return what a stretch, or a pair of stretches, leaves of a column."""
    if name == "faults":
        return (_any_bit,)
    if name == "bounce":
        return (_greatest,)
    return (_least, _greatest) if name.startswith(_DENSE) else (_first,)


class Stretches:
    """The columns in at most `most` stretches of equally many samples, a power of two."""

    def __init__(self, most: int = MOST) -> None:
        self.size = 1
        """Samples in a stretch."""
        self._most = most
        self._count = 0
        self._rest: dict[str, FloatArray] = {}
        self._kept: dict[str, list[FloatArray]] = {}

    def add(self, trace: Trace) -> None:
        """Further samples."""
        columns = {name: np.concatenate((self._rest.get(name, values[:0]), values)) for name, values in trace.items()}
        length, done = len(columns["time_s"]), 0
        while length - done >= self.size:
            count = min((length - done) // self.size, self._most - self._count)
            self._keep({name: values[done : done + count * self.size] for name, values in columns.items()}, count)
            done += count * self.size  # before the size doubles
            if self._count == self._most:
                self._halve()
        self._rest = {name: values[done:].copy() for name, values in columns.items()}

    def rows(self) -> dict[str, FloatArray]:
        """Return the columns reduced, two rows a stretch.

        They are least and greatest of what moves quickly, else twice the first.

        As they came where there are few. Times are those of the first sample and of the middle.
        """
        if self._rest and len(self._rest["time_s"]):
            self._keep(self._rest, 1)
            self._rest = {}
        kept = {name: [part[: self._count] for part in parts] for name, parts in self._kept.items()}
        if self.size == 1:
            return {name: parts[0] for name, parts in kept.items()}
        rows = {name: np.column_stack((parts[0], parts[-1])).ravel() for name, parts in kept.items()}
        start = kept["time_s"][0]
        rows["time_s"][1::2] = start + 0.5 * np.diff(start, append=start[-1])
        return rows

    def _keep(self, columns: Trace, count: int) -> None:
        for name, values in columns.items():
            rules = _rules(name)
            parts = self._kept.setdefault(name, [np.empty(self._most + 1) for _ in rules])
            for part, rule in zip(parts, rules, strict=True):
                part[self._count : self._count + count] = rule(values.reshape(count, -1))
        self._count += count

    def _halve(self) -> None:
        self.size *= 2
        self._count //= 2
        for name, parts in self._kept.items():
            for part, rule in zip(parts, _rules(name), strict=True):
                part[: self._count] = rule(part[: self._most].reshape(-1, 2))


class Groups:
    """What `of` makes of each `size` samples of some columns; the last ones, fewer than that, are left out.

    `of` takes the columns, as many samples as are whole groups, and return arrays with an element a group.
    """

    def __init__(self, size: int, of: Callable[..., tuple[FloatArray, ...]]) -> None:
        self._size = size
        self._of = of
        self._rest: list[FloatArray] = []
        self._reduced: list[tuple[FloatArray, ...]] = []

    def add(self, *columns: FloatArray) -> None:
        """Further samples."""
        rest = self._rest or [values[:0] for values in columns]
        joined = [np.concatenate(both) for both in zip(rest, columns, strict=True)]
        whole = len(joined[0]) // self._size * self._size
        self._rest = [values[whole:].copy() for values in joined]
        if whole:
            self._reduced.append(self._of(*(values[:whole] for values in joined)))

    def all(self) -> tuple[FloatArray, ...] | None:
        """Return what came of all groups; None if there was none."""
        return tuple(np.concatenate(parts) for parts in zip(*self._reduced, strict=True)) if self._reduced else None


class Ends:
    """Every sample of the first and of the last `seconds` [s]."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._head: list[Trace] = []
        self._tail: list[Trace] = []

    def add(self, trace: Trace) -> None:
        """Further samples."""
        time = trace["time_s"]
        if not len(time):
            return
        if time[0] <= self._seconds:
            self._head.append(_some(trace, time <= self._seconds))
        self._tail = [part for part in self._tail if part["time_s"][-1] >= time[-1] - self._seconds]
        self._tail.append(_some(trace, time >= time[-1] - self._seconds))

    def near(self, start: float) -> dict[str, FloatArray]:
        """Return the samples of `seconds` from `start` on, which is at either end."""
        parts = self._head if start <= 0.0 else self._tail
        joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        inside = (joined["time_s"] >= start) & (joined["time_s"] <= start + self._seconds)
        return _some(joined, inside)


def _some(trace: Trace, which: NDArray[np.bool_]) -> dict[str, FloatArray]:
    return {name: values[which] for name, values in trace.items()}
