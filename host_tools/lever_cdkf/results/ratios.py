"""Test ratios as the estimator sends them (`publish_test_ratios`), one statistic after the other.

They are what it watches for faults and changes, each over its threshold.
"""

from __future__ import annotations

import numpy as np

from ..firmware.estimator import TEST_RATIOS
from ..numeric.arrays import FloatArray
from .in_turn import InTurn

# column of the trace, its message and field
TEST_RATIO = (
    ("evidence", "TEST_RATIO", "evidence"),
    ("test_ratio", "TEST_RATIO", "ratio"),
    ("verdict", "TEST_RATIO", "verdict"),
)


class TestRatios(InTurn):
    """Keeps the ratio of each statistic, of samples as they come."""

    __test__ = False  # no class of tests, for pytest

    def __init__(self) -> None:
        super().__init__(["evidence", "test_ratio"], np.arange(float(len(TEST_RATIOS))))

    def at(self, time: FloatArray) -> FloatArray:
        """Return (times, statistics), as last sent before each time [s]; NaN before the first."""
        ratio: FloatArray = self.latest(time)[..., 0]
        return ratio
