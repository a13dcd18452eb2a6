"""An off-the-shelf unscented Kalman filter: FilterPy's, on z = [w; x], as its documentation suggests.

Source: R. R. Labbe Jr., FilterPy (https://github.com/rlabbe/filterpy), kalman/UKF.py and kalman/sigma_points.py; the
filter: E. A. Wan, R. van der Merwe, "The unscented Kalman filter for nonlinear estimation", AS-SPCC (2000).

As its users would: MerweScaledSigmaPoints with the values that its documentation calls usual (alpha 1e-3, beta 2,
kappa 0), no redrawing, no square root, process and measurement noise as known. Where a covariance is no longer positive
definite FilterPy raises an error; the run has ended then, and is NaN from there on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from lever_cdkf.host_tools.errors import LeverError
from numpy.typing import NDArray

from ...oracle.cdkf import Array
from ..data import OUTPUTS, PARAMETERS, STATES, Batch, Estimates
from .recursion import block_diagonal, normalised_square, output_covariance, walk_covariance


@dataclass(frozen=True)
class FilterPyUkf:
    """One run after the other, at most `most_runs` (the others are NaN): FilterPy knows no batches."""

    alpha: float = 1e-3
    beta: float = 2.0
    kappa: float = 0.0
    most_runs: int | None = None

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Raises LeverError when FilterPy is not installed."""
        shape = (batch.runs, len(at))
        w, covariance = np.full((*shape, PARAMETERS), np.nan), np.full((*shape, PARAMETERS, PARAMETERS), np.nan)
        nis = np.full(shape, np.nan)
        for run in range(batch.runs)[: self.most_runs]:
            self._follow(_only(batch, run), at, w[run], covariance[run], nis[run])
        return Estimates(at, w, covariance, nis)

    def breakdowns(self, estimates: Estimates) -> int:
        """How many of the runs that were begun did not last until the last sample reported."""
        return int(np.isnan(estimates.w[: self.most_runs, -1]).any(axis=1).sum())

    def _follow(self, batch: Batch, at: NDArray[np.int64], w: Array, covariance: Array, nis: Array) -> None:
        """Fills in what the filter makes of a batch of one run, until it breaks down."""
        ukf = self._started(batch)
        done = 0
        with np.errstate(over="ignore", invalid="ignore"):
            for column, sample in enumerate(at.tolist()):
                if not _advance(ukf, batch.y[0], done, sample):
                    return
                done = sample
                w[column], covariance[column] = ukf.x[:PARAMETERS], ukf.P[:PARAMETERS, :PARAMETERS]
                if sample:
                    nis[column] = normalised_square(ukf.y[np.newaxis], ukf.S[np.newaxis])[0]

    def _started(self, batch: Batch) -> Any:
        """The filter at sample 0 of a batch of one run."""
        try:
            from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
        except ImportError:
            raise LeverError("the baseline filterpy_ukf needs FilterPy: pip install filterpy") from None

        def move(z: Array, dt: float, k: int) -> Array:
            moved = batch.move(k, z[np.newaxis, PARAMETERS:], z[np.newaxis, :PARAMETERS])
            return np.concatenate((z[:PARAMETERS], moved[0]))

        size = PARAMETERS + STATES
        points = MerweScaledSigmaPoints(size, self.alpha, self.beta, self.kappa)
        ukf = UnscentedKalmanFilter(size, OUTPUTS, batch.period, lambda z: z[PARAMETERS:], move, points)
        ukf.x = np.concatenate((np.zeros(PARAMETERS), batch.y[0, 0]))
        ukf.R = output_covariance(batch)
        ukf.P = block_diagonal(np.diag(batch.knowledge.sigma_w**2), ukf.R)
        ukf.Q = block_diagonal(walk_covariance(batch), batch.knowledge.process_covariance(batch.period))
        return ukf


def _advance(ukf: Any, y: Array, first: int, last: int) -> bool:
    """From sample `first` to sample `last` of y (K, 2); False when it broke down on the way."""
    try:
        for k in range(first + 1, last + 1):
            ukf.predict(k=k - 1)
            ukf.update(y[k])
    except ValueError:  # numpy's LinAlgError is one: no longer positive definite; and so is scipy's of NaN
        return False
    return True


def _only(batch: Batch, run: int) -> Batch:
    """The batch of one of its runs."""
    one = slice(run, run + 1)
    return replace(batch, y=batch.y[one], u=batch.u[one], trim=batch.trim[one])
