"""How much of the time there were faults that tell the user not to trust the estimates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import FloatArray
from ..firmware.library import enum_names

WARNINGS = ("theta", "theta_dot", "torque", "base", "innovation", "bound", "mismatch", "calibration", "hands_off")
"""Faults that tell the user not to trust the estimates. Others, such as change, tell what the estimator is doing."""

OPTIONAL = {"theta_dot": "theta_dot", "torque": "tau_m"}
"""Inputs that a recording may lack, by the fault that says so."""

WORDS = {
    "theta": "theta is missing, stuck or not plausible",
    "theta_dot": "theta_dot is missing, stuck or not plausible",
    "torque": "the motor torque is missing, or is not what was asked for",
    "base": "the base acceleration is missing, or does not fit the motion",
    "gap": "samples were missing",
    "communication": "frames corrupt, repeated or out of order",
    "innovation": "innovations larger than predicted",
    "excitation": "too little motion to learn from",
    "bound": "a parameter rests on its bound",
    "recovered": "the filter was restarted",
    "change": "sudden change of the pilot, learning anew",
    "platform": "the machine reports a fault of its own",
    "clock": "the sample clock stands or runs backwards",
    "duplicate": "a second estimator is on this bus",
    "settling": "levels settling, nothing is learnt",
    "mismatch": "innovations are not white: something moves the lever that the model lacks",
    "calibration": "torque, base and grip force do not agree on the pilot",
    "hands_off": "nobody holds the lever",
}
"""Conditions of the estimator, by enum lever_fault."""

LITTLE = 0.02
"""Share of the judged time, below which a fault is a passing one."""


def warning_bits(without: tuple[str, ...] = ()) -> int:
    """WARNINGS as a mask of lever_fault, but for some."""
    return sum(bit for bit, name in enum_names("lever_fault").items() if name in WARNINGS and name not in without)


@dataclass
class FaultCounts:
    """Over samples as they come."""

    samples: int = 0
    each: dict[str, int] = field(default_factory=dict)
    warned: int = 0
    """Samples with any of WARNINGS."""

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
        """Of the samples with any of WARNINGS; None without samples."""
        return self.warned / self.samples if self.samples else None
