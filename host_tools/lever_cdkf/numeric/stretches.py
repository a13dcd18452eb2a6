"""Stretches in which something is so."""

import numpy as np

from .arrays import BoolArray


def runs(active: BoolArray) -> list[tuple[int, int]]:
    """Return first and last index of every stretch in which `active` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], active, [False])).astype(np.int8)))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]
