"""Detection of a sudden change of the pilot: the corrections of w, white as long as all is right, point one way."""

import numpy as np
from lever_cdkf.numeric.arrays import Array

LEAST = 1e-3  # standard deviation that the sum always has, in those of the prior
LONG = 100.0  # memory of the average of the statistic, in memories of the sum


class ChangeDetection:
    """A. S. Willsky, H. L. Jones, "A generalized likelihood ratio approach", IEEE TAC 21 (1976), without the bank."""

    def __init__(self, memory: float, threshold: float, prior_sigma: Array) -> None:
        self.memory, self.threshold = memory, threshold
        self.least = np.diag((LEAST * prior_sigma) ** 2)
        self.average = 1.0  # of the statistic per parameter
        self._begin()

    def _begin(self) -> None:
        self.sum: Array = np.zeros(3)
        self.covariance: Array = np.zeros((3, 3))

    def step(self, correction: Array, covariance: Array, period: float) -> bool:
        """Take a correction (3,) and the covariance expected of it (3, 3), `period` [s] after the last.

        Return whether w has changed.
        """
        share = min(period / self.memory, 1.0)
        self.sum = (1.0 - share) * self.sum + correction
        self.covariance = (1.0 - share) ** 2 * self.covariance + covariance
        statistic = float(self.sum @ np.linalg.solve(self.covariance + self.least, self.sum))
        self.average += share / LONG * (statistic / 3.0 - self.average)
        changed = 0.0 < self.threshold < statistic / max(self.average, 1.0)
        if changed:
            self._begin()
        return changed
