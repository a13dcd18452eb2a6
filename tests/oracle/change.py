"""Detection of a sudden change of the pilot: the corrections of w, white as long as all is right, point one way."""

import numpy as np
from lever_cdkf.numeric.arrays import Array

LONG = 100.0  # memory of the average of the statistic, in memories of the sum


class ChangeDetection:
    """A. S. Willsky, H. L. Jones, "A generalized likelihood ratio approach", IEEE TAC 21 (1976), without the bank."""

    def __init__(self, memory: float, threshold: float) -> None:
        self.memory, self.threshold = memory, threshold
        self.average = 1.0  # of the statistic per parameter
        self._begin()

    def _begin(self) -> None:
        self.sum: Array = np.zeros(3)
        self.variance: Array = np.zeros(3)

    def step(self, correction: Array, variance: Array, period: float) -> bool:
        """Return a correction and the variance expected of it, `period` [s] after the last; returns whether w has
        changed."""
        share = min(period / self.memory, 1.0)
        self.sum = (1.0 - share) * self.sum + correction
        self.variance = (1.0 - share) ** 2 * self.variance + np.maximum(variance, 0.0)
        positive = self.variance > 0.0
        statistic = float(np.sum(self.sum[positive] ** 2 / self.variance[positive]))
        self.average += share / LONG * (statistic / 3.0 - self.average)
        changed = 0.0 < self.threshold < statistic / max(self.average, 1.0)
        if changed:
            self._begin()
        return changed
