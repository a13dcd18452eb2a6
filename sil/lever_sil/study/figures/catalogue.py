"""All figures by name, and how to get at those that somebody asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from lever_cdkf.errors import LeverError
from lever_cdkf.text.suggestions import did_you_mean

from . import bode, consistency, grip, identification, linear
from .description import Figure
from .runs import Extent

Make = Callable[[int, Extent], Figure]
"""A figure of a seed; the same seed gives the same figure."""

FIGURES: Mapping[str, Make] = {
    "bode": bode.bode,
    "excitation": linear.excitation,
    "parameters": linear.parameters,
    "states": linear.states,
    "identification": identification.identification,
    "grip": grip.grip,
    "consistency": consistency.nees,
}
"""In the order of the page."""


def chosen(names: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the names in the order of the known ones; by default all. Raise LeverError for an unknown one."""
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known, f"there are {', '.join(known)}")
            raise LeverError(f"unknown figure {name!r}; {hint}")
    return [name for name in known if name in names or not names]


def summary(name: str) -> str:
    """Return the figure in a line."""
    return (FIGURES[name].__doc__ or "").splitlines()[0]
