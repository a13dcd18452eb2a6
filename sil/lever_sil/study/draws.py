"""What every study draws at random: a stream of numbers for each purpose in each run, and the excitation."""

from __future__ import annotations

import numpy as np
from lever_cdkf.numeric.arrays import Array

from ..plants.excitation import Noise

STREAMS = ("base", "dither", "pilot", "process", "output")
"""What random numbers are drawn for, each from a stream of its own in each run; a new purpose goes to the end."""


def stream(seed: int, purpose: str, run: int) -> np.random.Generator:
    """Return the random numbers for one purpose of STREAMS in one run; no other draw shifts them."""
    key = (STREAMS.index(purpose), run)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=key)))


def streams(seed: int, runs: int) -> list[dict[str, np.random.Generator]]:
    """Return all of each run, by purpose."""
    return [{purpose: stream(seed, purpose, run) for purpose in STREAMS} for run in range(runs)]


def excitation(
    rms: tuple[float, float], band: tuple[float, float], time: Array, own: dict[str, np.random.Generator]
) -> Array:
    """Return (K, 2) z_ddot [m/s²] and tau_m [N m] of one run at the times (K,) [s].

    They are noise of `rms` in the `band` [Hz].
    """
    low, high = band
    sources = zip(rms, (own["base"], own["dither"]), strict=True)
    return np.stack([Noise(rms=part, low=low, high=high).samples(time, rng) for part, rng in sources], axis=-1)
