"""How the floor moves the lever while the pilot changes: magnitude of theta/z_ddot over time and frequency."""

from __future__ import annotations

import numpy as np
from lever_cdkf.models.lever import Lever
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.bode import FREQUENCIES, transfer

from ...measures import rms
from ..data import rest_angle
from ..matched import Condition, matched
from .description import Column, Figure, Surface, number, percent
from .runs import PRIOR, Extent, estimates, late, matched_config, shown

_DRIFT = {"m_p_walk": 0.01, "c_p_walk": 0.06, "k_p_walk": 0.06}  # [1/√s]: stiffness by half in a minute
_LENGTH = 3.0  # durations of the other figures: a drift takes its time


def bode(seed: int, extent: Extent) -> Figure:
    """Draw magnitude of θ/z̈ over time and frequency while the pilot drifts, truth and estimate."""
    condition = Condition("lever", "fixed", settings={**PRIOR, **_DRIFT})
    batch = matched(condition, 1, _LENGTH * extent.duration, seed)
    at = shown(batch)
    time = at * batch.period
    estimated = estimates(matched_config(condition, "dual"), batch, at=at)
    assert batch.truth.p is not None
    lever = Lever.from_settings(condition.all_settings(), "fixed")
    truth = _surface(lever, time, batch.truth.p[0, at], batch.truth.dynamics[0, at, 0], batch.period)
    estimate = _surface(lever, time, estimated["parameter"], estimated["natural_frequency"], batch.period)
    return Figure(
        "bode",
        "Bode diagram of the lever in time",
        _caption(truth, estimate),
        (Column("truth", truth), Column("estimate", estimate)),
        (0.0, batch.samples * batch.period),
        row_height=2.0,
    )


def _surface(lever: Lever, time: Array, p: Array, natural_frequency: Array, period: float) -> Surface:
    """Return the surface of parameters (T, 3), about the angle at which they hold the lever."""
    angle = rest_angle(lever, p.T, np.zeros(len(p)), period)
    magnitude = np.degrees(np.abs(transfer("lever", lever, p.T, angle).response(FREQUENCIES)))
    there = [np.interp(*at) for at in zip(natural_frequency, [FREQUENCIES] * len(p), magnitude, strict=True)]
    label = "|θ/z̈| [deg per m/s²]"
    return Surface(time, FREQUENCIES, magnitude.T, label, natural_frequency, np.array(there), "natural frequency")


def _caption(truth: Surface, estimate: Surface) -> str:
    settled = late(truth.time)
    frequency = rms((estimate.ridge / truth.ridge - 1.0)[settled])
    peak = rms((estimate.magnitude.max(axis=0) / truth.magnitude.max(axis=0) - 1.0)[settled])
    return (
        "How far the lever moves for the acceleration of the floor, over frequency and time, while mass, damping and "
        "stiffness of the pilot's arm drift as random walks: the truth, and the same from the firmware's estimates "
        "(dual filter, base motion only), on one scale. The line is the natural frequency, which wanders between "
        f"{number(truth.ridge.min(), 3)} and {number(truth.ridge.max(), 3)} Hz; the peak is between "
        f"{number(truth.magnitude.max(axis=0).min())} and {number(truth.magnitude.max(axis=0).max())} deg per m/s². "
        f"In the second half of the run the estimate is off by {percent(frequency)} rms in natural frequency and "
        f"{percent(peak)} rms in the height of the peak."
    )
