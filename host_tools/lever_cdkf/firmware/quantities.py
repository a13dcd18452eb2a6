"""What is estimated and judged: names, units, symbols and trace columns, for each model of the firmware.

Names and units of the parameters are the firmware's; all that shows them (trace, summary, tables, report) asks here.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache

from .config import model_parameters, setting

_WORDS = {
    "m": "mass",
    "c": "damping",
    "k": "stiffness",
    "m_p": "mass",
    "c_p": "damping",
    "k_p": "stiffness",
    "a21": "minus stiffness",
    "a22": "minus damping",
    "b21": "answer to the floor",
    "k_hand": "stiffness per mass",
    "c_hand": "damping per mass",
    "c_space": "of it, in space",
}


LEAST_COVERAGE = 0.9
"""Least share of the time with the truth within +-2 sigma, or sigma is called too small; Gaussian errors: 95.4 %."""


@dataclass(frozen=True)
class Quantity:
    """Something that is estimated."""

    key: str
    """Its name in the firmware, in scenarios and in summary.json."""
    unit: str
    """"1" without one."""
    name: str
    """In words."""
    symbol: str
    """As HTML."""
    signed: bool = False
    """Whether it may be negative."""

    @property
    def least(self) -> float:
        """Its physical bound."""
        return -math.inf if self.signed else 0.0

    @property
    def shown_unit(self) -> str:
        """For people to read."""
        return self.unit.replace("^2", "²")

    def column(self, kind: str) -> str:
        """Return its column in the trace; `kind` is true, estimate or sigma."""
        ending = re.sub("[ /]", "_", self.unit.replace("^", ""))
        return f"{self.key}_{kind}" if self.unit == "1" else f"{self.key}_{kind}_{ending}"


DYNAMICS = (
    Quantity("natural_frequency", "Hz", "natural frequency", "f<sub>n</sub>"),
    Quantity("damping_ratio", "1", "damping ratio", "ζ"),
)
"""What every model has."""


@cache
def parameters(model: str) -> tuple[Quantity, ...]:
    """Return the parameters of a model, in the firmware's order. Raise SettingsError for a model that is none."""
    return tuple(
        Quantity(name, unit, _WORDS.get(name, name), _symbol(name), setting(name).least < 0.0)
        for name, unit in model_parameters(model)
    )


def quantities(model: str) -> tuple[Quantity, ...]:
    """Return all that is judged of an estimator with this model."""
    return parameters(model) + DYNAMICS


def recorded_name(column: str) -> str:
    """Return the column of an estimate as a replayed log has it.

    It is k_p_recorded_N_m of k_p_estimate_N_m, nis_recorded of nis.
    """
    for kind in ("_estimate", "_sigma"):
        if kind in column:
            return column.replace(kind, "_recorded" if kind == "_estimate" else "_recorded_sigma")
    return f"{column}_recorded"


def _symbol(name: str) -> str:
    """m_p as m with index p, a21 as a with index 21."""
    letter, index = name[0], name[1:].removeprefix("_")
    return f"{letter}<sub>{index}</sub>" if index else letter
