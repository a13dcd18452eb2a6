"""Test ratios as the estimator sends them (`publish_test_ratios`), one statistic after the other.

They are what it watches for faults and changes, each over its threshold.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from ..firmware.estimator import TEST_RATIOS
from ..firmware.library import enum_names
from ..numeric.arrays import FloatArray
from .in_turn import InTurn
from .trace import Trace
from .trust import EVIDENCE

# column of the trace, its message and field
TEST_RATIO = (
    ("evidence", "TEST_RATIO", "evidence"),
    ("test_ratio", "TEST_RATIO", "ratio"),
    ("verdict", "TEST_RATIO", "verdict"),
)


def behind_calibration(trace: Trace, judged: NDArray[np.bool_]) -> Counter[str] | None:
    """Return how many of the judged samples have a ratio above 1 of each evidence that shows as calibration.

    Counted are samples that show it. None: test ratios were not sent.
    """
    if "test_ratio" not in trace:
        return None
    bit = next(bit for bit, name in enum_names("lever_fault").items() if name == "calibration")
    shows = np.nan_to_num(trace["faults"]).astype(np.int64) & bit != 0
    numbers = trace["evidence"][judged & shows & (trace["test_ratio"] > 1.0)].astype(np.int64)
    counts = zip(TEST_RATIOS, np.bincount(numbers, minlength=len(TEST_RATIOS)).tolist(), strict=False)
    return Counter({name: count for name, count in counts if count and name in EVIDENCE})


class TestRatios(InTurn):
    """Keeps the ratio of each statistic, of samples as they come."""

    __test__ = False  # no class of tests, for pytest

    def __init__(self) -> None:
        super().__init__(["evidence", "test_ratio"], np.arange(float(len(TEST_RATIOS))))

    def at(self, time: FloatArray) -> FloatArray:
        """Return (times, statistics), as last sent before each time [s]; NaN before the first."""
        ratio: FloatArray = self.latest(time)[..., 0]
        return ratio
