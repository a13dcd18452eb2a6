"""The points of a design, each from its number alone, so that no list of them is ever kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .axis import Written
from .spec import Spec

_POINT, _ORDER = 0, 1  # purposes of random numbers


def point(spec: Spec, number: int) -> dict[str, Written]:
    """Return what is set at point `number` (from 0): scenario values by dotted key.

    In a grid the last axis goes fastest.
    """
    if spec.design == "grid":
        return _of_grid(spec, number)
    positions = _stream(spec, _POINT, number).random(len(spec.vary))
    if spec.design == "latin_hypercube":
        cells = [_order(spec.seed, index, spec.size)[number] for index in range(len(spec.vary))]
        positions = (np.array(cells) + positions) / spec.size
    return _merged(axis.at(float(at)) for axis, at in zip(spec.vary, positions, strict=True))


def _of_grid(spec: Spec, number: int) -> dict[str, Written]:
    parts = []
    for axis in reversed(spec.vary):
        number, index = divmod(number, axis.size)
        parts.append(axis.of_grid(index))
    return _merged(reversed(parts))


def _merged(parts: Iterable[Mapping[str, Written]]) -> dict[str, Written]:
    return {key: value for part in parts for key, value in part.items()}


def _stream(spec: Spec, purpose: int, number: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(spec.seed, spawn_key=(purpose, number))))


@lru_cache(maxsize=16)
def _order(seed: int, axis: int, size: int) -> NDArray[np.int64]:
    """Return which of the `size` equal parts of an axis each point of a Latin hypercube is in."""
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(_ORDER, axis))))
    return rng.permutation(size)


def columns(spec: Spec, values: Mapping[str, Written]) -> dict[str, float | str]:
    """Return what rows have of a point: the value of each axis."""
    return {axis.key: axis.column(values) for axis in spec.vary}
