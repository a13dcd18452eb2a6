"""Runs in which the pilot suddenly tightens or slackens the grip: how fast that is followed, and what it costs.

The truth is the nonlinear lever, in continuous time but for short substeps; parameters are constant but for one step of
c_p and k_p. Base and motor shake it, both measured without error; theta and theta_dot are measured with white noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.models.lever import Lever
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.text.units import GRAVITY

from .data import OUTPUTS, PARAMETERS, Batch, Truth
from .detrended import measured
from .draws import excitation, streams
from .matched import KINDS

LONGEST_SUBSTEP = 0.5e-3
"""[s]; second order: at 4 Hz the frequency is then right to 1e-5."""


@dataclass(frozen=True)
class Step:
    """What a batch is drawn from."""

    model: str = "lever"
    """What estimators assume: one of matched.KINDS. The truth is the lever."""
    factor: float = 1.3
    """By which c_p and k_p are multiplied."""
    at: float = 25.0
    """When [s]."""
    duration: float = 45.0
    """[s]"""
    process_noise: float = 0.05
    """[rad/s/√s]"""
    base_rms: float = 0.1 * GRAVITY
    """[m/s²]"""
    dither_rms: float = 0.3
    """[N m]"""
    band: tuple[float, float] = (1.0, 10.0)
    """Of base and dither [Hz]."""
    trim: float = math.radians(20.0)
    """Where the lever rests [rad]."""
    spread: float = 0.25
    """Parameters before the step: uniform, so far about the first guess on either side, relative."""


def stepped(step: Step, runs: int, seed: int) -> Batch:
    """Return `runs` runs, detrended; run i is the same, to the bit, whatever `runs` is."""
    settings = Config().settings | {"theta_dot_process_noise": step.process_noise}
    lever, period = Lever.from_settings(settings, "trim"), settings["sample_period"]
    drawn_from = streams(seed, runs)
    time = np.arange(max(2, round(step.duration / period)), dtype=np.float64) * period

    u = np.stack([excitation((step.base_rms, step.dither_rms), step.band, time, own) for own in drawn_from])
    guess = np.array([settings[name] for name in KINDS["lever"].parameters])
    first = np.stack([guess * own["pilot"].uniform(1 - step.spread, 1 + step.spread, PARAMETERS) for own in drawn_from])
    factor = np.where(time[:, None] < step.at, 1.0, (1.0, step.factor, step.factor))
    p = first[:, None] * factor
    substeps = substeps_of(period)
    kick = step.process_noise * math.sqrt(period / substeps)
    kicks = np.stack([kick * own["process"].standard_normal((len(time) - 1, substeps)) for own in drawn_from])
    x = follow(lever, p, u, step.trim, kicks, period)
    white = np.stack([own["output"].standard_normal((len(time), OUTPUTS)) for own in drawn_from])
    y = x + np.array((settings["theta_noise"], settings["theta_dot_noise"])) * white
    dynamics = np.moveaxis(lever.dynamics(np.moveaxis(p, -1, 0), step.trim), 0, -1)
    truth = Truth(x, p if step.model == "lever" else None, dynamics)
    return measured(settings, step.model, "trim", (y, u), truth)


def substeps_of(period: float) -> int:
    """Return the fewest in a period [s] of which none is longer than LONGEST_SUBSTEP."""
    return math.ceil(period / LONGEST_SUBSTEP - 1e-6)


def follow(lever: Lever, p: Array, u: Array, trim: float, kicks: Array, period: float) -> Array:
    """Return (B, K, 2) states from rest; parameters (B, K, 3) held and inputs (B, K, 2) interpolated between samples.

    kicks (B, K - 1, substeps): what noise adds to theta_dot [rad/s] (Euler–Maruyama; the drift by Lever.step).
    """
    runs, samples = p.shape[:2]
    substeps = kicks.shape[2]
    p, u, kicks = (np.ascontiguousarray(part.transpose(1, 2, 0)) for part in (p, u, kicks))
    x = np.zeros((samples, 2, runs))
    x[0, 0] = trim
    middles, h = ((np.arange(substeps) + 0.5) / substeps).tolist(), period / substeps
    for k in range(samples - 1):
        now, change = x[k], u[k + 1] - u[k]
        for middle, kick in zip(middles, kicks[k], strict=True):
            between = u[k] + middle * change
            now = lever.step(now, p[k], (between[0], between[1]), trim, h)
            now[1] += kick
        x[k + 1] = now
    return np.ascontiguousarray(x.transpose(2, 0, 1))
