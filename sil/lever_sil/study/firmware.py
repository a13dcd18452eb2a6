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
    """The firmware as a `data.Estimator`: choices and settings by name, defaults for what is not given.

    Before its first estimate, while it aligns, it reports the first guess. From where it has refused a factor or an
    estimate and started anew, it is said to have broken down.
    """

    model: str = "lever"
    preload: str = "trim"
    estimator: str = "dual"
    adaptation: str = "robbins_monro"
    settings: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, batch: Batch, at: NDArray[np.int64]) -> Estimates:
        """Run the firmware over a batch; report at the samples `at`."""
        config = Config(self.model, self.preload, self.estimator, self.adaptation, settings=EXACT | dict(self.settings))
        time_us = np.arange(batch.samples, dtype=np.int64) * round(batch.period * 1e6)
        runs = [
            run_samples(
                config,
                {"time_us": time_us, "theta": y[:, 0], "theta_dot": y[:, 1], "z_ddot": u[:, 0], "tau_m": u[:, 1]},
                at,
            )
            for y, u in zip(batch.raw_y, batch.raw_u, strict=True)
        ]
        columns = {name: np.stack([run[name] for run in runs]).astype(np.float64) for name in _COLUMNS}
        w = np.where(columns["recoveries"][..., None] > 0.0, np.nan, batch.knowledge.scaled(columns["parameter"]))
        scale = columns["parameter"] if batch.knowledge.positive else batch.knowledge.sigma
        sigma = columns["parameter_sigma"] / scale
        return Estimates(at, w, covariance_of(sigma, columns["parameter_correlation"]), columns["nis"])


_COLUMNS = ("parameter", "parameter_sigma", "parameter_correlation", "nis", "recoveries")
