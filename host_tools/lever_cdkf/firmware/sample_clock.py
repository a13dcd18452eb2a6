"""The period of recorded samples, and whether it is sample_period: judged as the firmware judges its sender's clock."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

CLOCK_WRONG = 0.05
"""The time of samples may differ by this part of sample_period: EVIDENCE_CLOCK of firmware/app/evidence.def."""


def is_other_period(found: float, period: float) -> bool:
    """Return whether a period that was found is another than sample_period, which the firmware shows as CALIBRATION."""
    return abs(found - period) > CLOCK_WRONG * period


def period_of(steps: NDArray[Any], period: float) -> float:
    """Return the step of most samples or, where that is near the period, the mean one, in the unit of both.

    That is the period, unless steps are longer though each long one is that of lost samples, or shorter though none is.
    """
    most, mean = float(np.median(steps)), float(steps.mean())
    if not 0.7 < most / period < 1.4 and is_other_period(mean, period):
        return most
    longer = float(steps.sum() / np.maximum(np.rint(steps / period), 1.0).sum())
    return longer if longer > period else min(mean, period)
