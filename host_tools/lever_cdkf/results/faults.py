"""How much of the time there were faults that tell the user not to trust the estimates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..firmware.estimator import DO_NOT_TRUST
from ..firmware.library import enum_names
from ..numeric.arrays import FloatArray

OPTIONAL = {"theta_dot": "theta_dot", "torque": "tau_m"}
"""Inputs that a recording may lack, by the fault that says so."""

LITTLE = 0.02
"""Share of the judged time, below which a fault is a passing one."""


def warning_bits(without: tuple[str, ...] = ()) -> int:
    """DO_NOT_TRUST but for some faults by name."""
    return DO_NOT_TRUST & ~sum(bit for bit, name in enum_names("lever_fault").items() if name in without)


@dataclass
class FaultCounts:
    """Over samples as they come."""

    samples: int = 0
    each: dict[str, int] = field(default_factory=dict)
    warned: int = 0
    """Samples with any of DO_NOT_TRUST."""

    def add(self, column: FloatArray, without: tuple[str, ...] = ()) -> None:
        """Further samples: masks of lever_fault, NaN where it is not known; `without`: faults that do not count."""
        faults = column[np.isfinite(column)].astype(np.int64)
        self.samples += len(faults)
        for bit, name in enum_names("lever_fault").items():
            if name in without:
                continue
            if count := int(np.count_nonzero(faults & bit)):
                self.each[name] = self.each.get(name, 0) + count
        self.warned += int(np.count_nonzero(faults & warning_bits(without)))

    @property
    def shares(self) -> dict[str, float]:
        """Of the samples with each fault that there was (0 to 1)."""
        return {name: count / self.samples for name, count in self.each.items()}

    @property
    def warned_share(self) -> float | None:
        """Of the samples with any of DO_NOT_TRUST; None without samples."""
        return self.warned / self.samples if self.samples else None
