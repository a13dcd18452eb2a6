"""The firmware's own estimators in a comparison: the C code, in single precision, fed with what sensors would give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from lever_cdkf.firmware.native import Config, run_samples
from numpy.typing import NDArray

from ..measures import covariance_of
from .data import Batch, Estimates

EXACT = dict.fromkeys(("z_ddot_gain_sigma", "z_ddot_delay_sigma", "tau_m_gain_sigma", "lever_friction_sigma"), 0.0)
"""Settings for data whose inputs are measured without errors, of a lever without friction."""


@dataclass(frozen=True)
class Firmware:
    """The firmware as a `data.Estimator`: choices, and settings by name.

    Before its first estimate, while it aligns, it reports the first guess. From where it has refused a factor or an
    estimate and started anew, it is said to have broken down.
    """

    model: str
    preload: str
    estimator: str
    adaptation: str = "robbins_monro"
    settings: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run the firmware over a batch; report at the samples `at`."""
        config = Config(self.model, self.preload, self.estimator, self.adaptation, settings=EXACT | dict(self.settings))
        runs = [run_of(config, batch, run, at) for run in range(batch.runs)]
        columns = {name: np.stack([run[name] for run in runs]).astype(np.float64) for name in _COLUMNS}
        w = np.where(columns["recoveries"][..., None] > 0.0, np.nan, batch.knowledge.scaled(columns["parameter"]))
        scale = columns["parameter"] if batch.knowledge.positive else batch.knowledge.sigma
        sigma = columns["parameter_sigma"] / scale
        return Estimates(at, w, covariance_of(sigma, columns["parameter_correlation"]), columns["nis"])


def run_of(
    config: Config, batch: Batch, run: int, at: NDArray[np.int64] | None = None
) -> dict[str, NDArray[np.generic]]:
    """Return columns of lever_estimate_t after the samples `at` of a run, after all of them by default."""
    (theta, theta_dot), (z_ddot, tau_m) = batch.raw_y[run].T, batch.raw_u[run].T
    time_us = np.arange(batch.samples, dtype=np.int64) * round(batch.period * 1e6)
    samples = {"time_us": time_us, "theta": theta, "theta_dot": theta_dot, "z_ddot": z_ddot, "tau_m": tau_m}
    return run_samples(config, samples, at)


_COLUMNS = ("parameter", "parameter_sigma", "parameter_correlation", "nis", "recoveries")
