"""The five figures of the paper, made of ours: which is which, what is the same, and what is not.

T. Aresi, A. Zanoni, P. Masarati, "Continuous Time Estimation of Pilot Biodynamic Response for Vertical Bounce Coupling
Assessment". It prints no parameter value, covariance, seed or error, so figures can agree in what they show, not in
numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

from . import bode, identification, linear
from .description import Figure
from .runs import Extent

_EVERYWHERE = "Inputs, noises and first guesses are ours, and so is the implicit midpoint step (there: Euler-Maruyama)."


@dataclass(frozen=True)
class _Counterpart:
    make: Callable[[int, Extent], Figure]
    same: str
    differs: str


_FIGURES = (
    _Counterpart(
        bode.bode,
        "Bode diagrams of the lever over time, while the pilot's parameters vary.",
        "The phase is not drawn. The truth is drawn beside the estimate.",
    ),
    _Counterpart(
        linear.excitation,
        "Excitation of the linear system, and its response with process noise.",
        "The response without that noise is added, so that its share can be seen.",
    ),
    _Counterpart(
        linear.parameters,
        "Parameters of the linear system, true and estimated, over time.",
        "Both linear models are shown, with the band of ±2σ that the filter states. "
        "The walk of the parameters is fixed; there it is annealed, or adapted by Robbins-Monro.",
    ),
    _Counterpart(
        linear.states,
        "States of the linear system, true and estimated.",
        "Errors are drawn against the stated ±2σ.",
    ),
    _Counterpart(
        identification.identification,
        "Parameters of the nonlinear lever, true and estimated, over time.",
        "Estimates without and with a known motor torque stand side by side, with those of the joint filter, and with "
        "the standard deviation of a filter linearised at the truth. The walk of the parameters is fixed.",
    ),
)


def _numbered(number: int, counterpart: _Counterpart, seed: int, extent: Extent) -> Figure:
    figure = counterpart.make(seed, extent)
    caption = (
        f"Figure {number} of the paper shows this, too: {counterpart.same} Not the same: {counterpart.differs} "
        f"{_EVERYWHERE} {figure.caption}"
    )
    name = f"figure_{number}_{figure.name}"
    return replace(figure, name=name, title=f"Figure {number}: {figure.title}", caption=caption)


PAPER: Mapping[str, Callable[[int, Extent], Figure]] = {
    f"figure_{number}_{counterpart.make.__name__}": partial(_numbered, number, counterpart)
    for number, counterpart in enumerate(_FIGURES, start=1)
}
"""By name, in the order of the paper."""
