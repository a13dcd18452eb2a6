"""What is left of measured signals without their slow part, for estimators that do not detrend by themselves.

The high-pass of lever_cdkf.models.detrend for all runs at once, started as the firmware does (firmware/filter/trim.c):
theta from its mean over the first moments, everything else from 0. All signals alike: so the deviations obey the same
dynamics.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from lever_cdkf.models.detrend import DAMPING
from lever_cdkf.numeric.arrays import Array

from .data import OUTPUTS, Batch, Knowledge, Truth
from .matched import KINDS, knowledge


def measured(
    settings: Mapping[str, float],
    model: str,
    preload: str,
    signals: tuple[Array, Array],
    truth: Truth,
    known: Knowledge | None = None,
) -> Batch:
    """Return runs of measured outputs and inputs, (B, K, 2) each, detrended with preload `trim`.

    Estimators are told what the settings say, unless it is something else that is `known`.
    """
    kind, (y, u) = KINDS[model], signals
    told = known or knowledge(settings, kind)
    trim = np.zeros(y.shape[:2])
    batch = Batch(kind.make(settings, preload), settings["sample_period"], y, u, trim, told, truth, y, u)
    return detrended(batch, settings) if preload == "trim" else batch


def detrended(batch: Batch, settings: Mapping[str, float]) -> Batch:
    """Return the batch with y, u and trim made of raw_y and raw_u.

    Their slow part is what is below `trim_corner`; theta is at first a mean of `align_time`.
    """
    signals = np.concatenate((batch.raw_y, batch.raw_u), axis=2)
    start = np.zeros((batch.runs, signals.shape[2]))
    start[:, 0] = batch.raw_y[:, : max(1, round(settings["align_time"] / batch.period)), 0].mean(axis=1)
    deviation, level = deviations(signals, start, settings["trim_corner"], batch.period)
    return replace(batch, y=deviation[..., :OUTPUTS], u=deviation[..., OUTPUTS:], trim=level[..., 0])


def deviations(signals: Array, start: Array, corner: float, dt: float) -> tuple[Array, Array]:
    """Return deviations of signals (B, K, n) from the levels before each sample, and those levels, both (B, K, n).

    The levels start at `start` (B, n), at rest; corner [Hz], dt [s].
    """
    from scipy.signal import sosfilt

    w = 2.0 * math.pi * corner
    left, sections = np.zeros((len(DAMPING), len(signals), 2, signals.shape[2])), []
    for damping in DAMPING:  # slope += dt w² d; level += dt (slope + damping w d) with the deviation d it leaves
        gain = dt * (dt * w**2 + damping * w)
        sections.append((1.0, -2.0, 1.0, 1.0, gain - 2.0, 1.0 - gain + (dt * w) ** 2))
    left[0, :, 0], left[0, :, 1] = -start, start
    deviation, _ = sosfilt(np.array(sections), signals, axis=1, zi=left)
    return deviation, signals - deviation
