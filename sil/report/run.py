"""What a run left behind, as the charts read it: columns that may be absent, and what follows from several of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from lever_cdkf.host_tools import native
from numpy.typing import NDArray

from ..oracle.lever import Lever
from .series import Array, jumps


@dataclass(frozen=True)
class Quantity:
    """Something that is estimated: its columns are {key}_true…, {key}_estimate… and {key}_sigma… + suffix."""

    key: str
    symbol: str
    name: str
    unit: str
    suffix: str

    @property
    def label(self) -> str:
        return f"{self.symbol} [{self.unit or '1'}]"


PARAMETERS = (
    Quantity("m_p", "m<sub>p</sub>", "mass", "kg", "_kg"),
    Quantity("c_p", "c<sub>p</sub>", "damping", "N s/m", "_N_s_m"),
    Quantity("k_p", "k<sub>p</sub>", "stiffness", "N/m", "_N_m"),
)
DYNAMICS = (
    Quantity("natural_frequency", "f<sub>n</sub>", "natural frequency", "Hz", "_Hz"),
    Quantity("damping_ratio", "ζ", "damping ratio", "", ""),
)
QUANTITIES = PARAMETERS + DYNAMICS


class Run:
    """A trace (columns of trace.csv) and its summary (summary.json; empty for a replayed log without truth)."""

    def __init__(self, trace: Mapping[str, NDArray[Any]], summary: Mapping[str, Any]) -> None:
        self.trace = trace
        self.summary = summary
        self.time: Array = np.asarray(trace["time_s"], dtype=np.float64)

    def column(self, name: str) -> Array | None:
        """A column, or None when it is absent or holds no value at all."""
        if name not in self.trace:
            return None
        values: Array = np.asarray(self.trace[name], dtype=np.float64)
        return values if np.isfinite(values).any() else None

    def first_of(self, *names: str) -> Array | None:
        """The first of several columns that is there."""
        return next((values for name in names if (values := self.column(name)) is not None), None)

    def truth(self, quantity: Quantity) -> Array | None:
        return self.column(f"{quantity.key}_true{quantity.suffix}")

    def estimate(self, quantity: Quantity) -> Array | None:
        return self.column(f"{quantity.key}_estimate{quantity.suffix}")

    def sigma(self, quantity: Quantity) -> Array | None:
        return self.column(f"{quantity.key}_sigma{quantity.suffix}")

    @property
    def end(self) -> float:
        return float(self.time[-1])

    @cached_property
    def has_truth(self) -> bool:
        return all(self.truth(quantity) is not None for quantity in PARAMETERS)

    @cached_property
    def sample_period(self) -> float:
        """[s]"""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 1.0

    @cached_property
    def settled(self) -> slice:
        """The part that axes are scaled for: after the first tenth, in which the estimator may still find its way."""
        return slice(len(self.time) // 10, None)

    @cached_property
    def changes(self) -> list[float]:
        """Times [s] at which the pilot or the trim jumped."""
        columns = [values for quantity in PARAMETERS if (values := self.truth(quantity)) is not None]
        trim = self.column("trim_true_rad")
        return jumps(self.time, columns + ([trim] if trim is not None else []))

    @cached_property
    def settings(self) -> dict[str, float]:
        """The estimator's settings: the run's own, and the firmware's defaults for what it does not tell."""
        defaults = {row.name: row.default for row in native.settings_table()}
        return defaults | dict(self.summary.get("estimator", {}).get("settings", {}))

    @cached_property
    def lever(self) -> Lever:
        return Lever.from_settings(self.settings, self.summary.get("estimator", {}).get("preload", "trim"))
