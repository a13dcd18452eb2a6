"""What the figures share: how much is run, what the filters are told, and the firmware on one run of a batch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.series import spread_indices
from numpy.typing import NDArray

from .. import matched
from ..data import Batch
from ..firmware import run_of
from ..matched import Condition

PRIOR = matched.PRIOR["lever"]
"""Of the lever's parameters, for truth and filter alike."""
MATCHED: Mapping[str, float] = {"change_threshold": 0.0, "noise_window": 0.0, "align_time": 0.0}
"""What the filter of a matched run must not do, since the truth gives no reason to: look for changes of the pilot,
learn the noises, or wait for a trim. To be used with preload fixed and adaptation fixed."""
DITHER = 0.4  # [N m] rms, where there is one
WILD = 0.05  # part of a run after which y axes are scaled

_POINTS = 400  # of a curve over the whole run


@dataclass(frozen=True)
class Extent:
    """How much is simulated. The defaults are those of the figures; tests take less."""

    duration: float = 20.0
    """Of a run [s]."""
    runs: int = 40
    """Of a batch of which statistics are shown."""


def matched_config(condition: Condition, estimator: str) -> Config:
    """Return what the firmware is told of a matched run with preload fixed."""
    settings = {**condition.settings, **MATCHED}
    return Config(condition.model, condition.preload, estimator, "fixed", settings=settings)


def shown(batch: Batch) -> NDArray[np.int64]:
    """Return samples at which curves over a whole run are drawn; the first and the last are among them."""
    return spread_indices(batch.samples, _POINTS).astype(np.int64)


def estimates(
    config: Config, batch: Batch, run: int = 0, at: NDArray[np.int64] | None = None
) -> dict[str, NDArray[np.float64]]:
    """Return columns of lever_estimate_t after the samples `at` (all without it) of one run, by the firmware."""
    return {name: column.astype(np.float64) for name, column in run_of(config, batch, run, at).items()}


def late(time: Array) -> NDArray[np.bool_]:
    """Return the second half of a run, in which an estimator has found its way."""
    second: NDArray[np.bool_] = time >= 0.5 * (time[0] + time[-1])
    return second
