"""The answer of the lever to the base, θ/z̈, over frequency and time, from the parameters and the linearised lever."""

import numpy as np
from numpy.typing import NDArray

from ..oracle.detrend import Detrend
from ..oracle.lever import Lever
from .series import Array

LONGEST_STEP = 0.05  # [s] that the trim moves on by after a gap
FREQUENCIES: Array = np.linspace(0.5, 12.0, 116)  # [Hz]


def response(lever: Lever, parameters: Array, trim: Array, frequency: Array = FREQUENCIES) -> NDArray[np.complex128]:
    """θ/z̈ [rad/(m/s²)], shape (times, frequencies), of parameters m_p, c_p, k_p (3, times) about the trim angles [rad].

    About the trim the lever of DESIGN section 3 is M θ̈ + D θ̇ + K θ = -l μ cos(trim) z̈.
    """
    m_p, c_p, k_p = parameters
    inertia = lever.total_inertia(m_p)[:, np.newaxis]
    damping = lever.rotational_damping(trim, c_p)[:, np.newaxis]
    stiffness = lever.rotational_stiffness(trim, m_p, k_p, trim)[:, np.newaxis]
    forcing = (-lever.unbalance(m_p) * np.cos(trim))[:, np.newaxis]
    s = (2j * np.pi * frequency).astype(np.complex128)
    answer: NDArray[np.complex128] = forcing / (inertia * s**2 + damping * s + stiffness)
    return answer


def slow_trim(time: Array, theta: Array, corner: float) -> Array:
    """The estimator's own idea of the trim angle [rad]: the slow part of θ, held over gaps (NaN); corner [Hz]."""
    trim = np.empty(len(theta))
    known = theta[np.isfinite(theta)]
    level = Detrend(float(known[0]) if known.size else 0.0)
    for index, (gap, angle) in enumerate(zip(np.diff(time, prepend=time[0]).tolist(), theta.tolist(), strict=True)):
        if angle == angle:
            level.step(angle, corner, min(gap, LONGEST_STEP))
        trim[index] = level.level
    return trim
