"""Random numbers by purpose: one seed makes a stream of its own for each name, which no other draw shifts."""

from __future__ import annotations

import zlib

import numpy as np

_NUMBERED = (
    "process", "theta", "theta_dot", "tau_m", "z_ddot", "m_p", "c_p", "k_p", "trim", "base", "torque", "dropout",
    "m", "c", "k", "a21", "a22", "b21", "m_t", "c_t", "k_t", "k_r", "c_r", "disturbance", "fault", "grip_force",
)  # fmt: skip
"""Names whose stream is by their place here, as it was for all once: what a seed means stays. Closed."""


def stream(seed: int, purpose: str, index: int = 0) -> np.random.Generator:
    """Return the random numbers of a seed for one purpose, by its name, and item."""
    number = _NUMBERED.index(purpose) if purpose in _NUMBERED else zlib.crc32(purpose.encode())
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(number, index))))
