"""Runs for the tests of the baselines: a pilot on the lever that shakes, measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from lever_cdkf.firmware.native import settings_table
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.data import Batch, Knowledge, Truth
from oracle import Lever

SETTINGS = {setting.name: setting.default for setting in settings_table()}
PILOT = np.array([2.5, 42.0, 1500.0])
G = 9.80665
PERIOD = 1e-3


@dataclass(frozen=True)
class Plan:
    """What is simulated; defaults as in the comparison of the firmware."""

    model: Any
    """A data.Model; the oracle's say float for what that says are arrays."""
    runs: int = 20
    duration: float = 30.0
    base: float = 0.1 * G  # rms of z_ddot [m/s²]
    torque: float = 0.3  # rms of tau_m [N m]
    output_noise: tuple[float, float] = (1e-3, 1e-2)
    process_noise: float = 0.05
    walk: tuple[float, float, float] = (0.01, 0.02, 0.02)
    guess: tuple[float, float, float] = (2.5, 42.0, 1500.0)
    sigma: tuple[float, float, float] = (0.2, 0.2, 0.2)
    positive: bool = True
    trim: float = 0.35
    start: tuple[float, float] = (0.0, 0.0)
    seed: int = 1
    period: float = PERIOD


def band_noise(rng: np.random.Generator, runs: int, count: int, rms: float, period: float) -> Array:
    """Return noise of 1 to 10 Hz, (runs, count)."""
    length = max(count, round(5.0 / period))
    spectrum = np.fft.rfft(rng.standard_normal((runs, length)))
    frequency = np.fft.rfftfreq(length, period)
    spectrum[:, (frequency < 1.0) | (frequency > 10.0)] = 0.0
    noise = np.fft.irfft(spectrum, length)
    scaled: Array = (noise * (rms / noise.std(axis=1, keepdims=True)))[:, :count]
    return scaled


@cache
def simulate(plan: Plan) -> Batch:
    """Return the truth moves as Batch.move says, w walks, theta_dot walks besides."""
    rng = np.random.default_rng(plan.seed)
    count = round(plan.duration / plan.period)
    shape = (plan.runs, count)
    knowledge = Knowledge(
        np.array(plan.guess),
        np.array(plan.sigma),
        np.array(plan.walk),
        plan.positive,
        np.array(plan.output_noise),
        plan.process_noise,
    )
    u = np.stack([band_noise(rng, *shape, rms, plan.period) for rms in (plan.base, plan.torque)], axis=2)
    trim = np.full(shape, plan.trim if plan.model.preload == "trim" else 0.0)
    w = rng.standard_normal((*shape, 3)) * knowledge.walk_w * np.sqrt(plan.period)
    w[:, 0] = rng.standard_normal((plan.runs, 3)) * knowledge.sigma_w
    w = w.cumsum(axis=1)
    x = np.empty((*shape, 2))
    x[:, 0] = plan.start
    nothing = Truth(x, None, x)
    batch = Batch(plan.model, plan.period, x, u, trim, knowledge, nothing, x, u)
    factor = np.linalg.cholesky(knowledge.process_covariance(plan.period) + 1e-30 * np.eye(2))
    kicks = rng.standard_normal((*shape, 2)) @ factor.T
    for k in range(count - 1):
        x[:, k + 1] = batch.move(k, x[:, k], w[:, k]) + kicks[:, k]
    p = knowledge.physical(w)
    dynamics = np.moveaxis(plan.model.dynamics(np.moveaxis(p, -1, 0), trim), 0, -1)
    y = x + rng.standard_normal(x.shape) * knowledge.output_noise
    return replace(batch, y=y, truth=Truth(x, p, dynamics), raw_y=y)


def lever(preload: str) -> Lever:
    return Lever.from_settings(SETTINGS, preload)


def resting_angle(of: Lever, p: Array = PILOT) -> float:
    """Where the pilot's arm and the lever's spring hold the weight (preload fixed), by bisection."""
    low, high = -1.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        up = float(of.restoring_torque(np.array(middle), p[0], p[2], 0.0)) > 0.0
        low, high = (low, middle) if up else (middle, high)
    return low
