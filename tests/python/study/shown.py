"""The figures that the tests look at: each is computed once."""

from __future__ import annotations

import functools

from lever_sil.study.figures import catalogue, runs
from lever_sil.study.figures.description import Figure

SHORT = runs.Extent(duration=4.0, runs=4)
SEED = 4
ONCE = {name: functools.cache(make) for name, make in catalogue.FIGURES.items()}
"""catalogue.FIGURES, which compute nothing twice."""


def figure_of(name: str) -> Figure:
    return ONCE[name](SEED, SHORT)
