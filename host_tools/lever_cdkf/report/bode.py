"""The answer of the lever to the base, θ/z̈, over frequency and time, from the parameters of a model."""

from collections.abc import Callable, Mapping

import numpy as np

from ..models.detrend import Detrend
from ..models.lever import Lever
from ..models.transfer import Transfer
from ..numeric.arrays import Array, ComplexArray
from ..results.feedthrough import FREQUENCIES as SENT

SIGMAS = 2.0
"""A band reaches so many standard deviations to either side."""
LONGEST_STEP = 0.05  # [s] that the trim moves on by after a gap
FREQUENCIES: Array = np.linspace(0.5, 12.0, 116)  # [Hz]


def transfer(model: str, lever: Lever, parameters: Array, trim: Array) -> Transfer:
    """θ/z̈ of a model of the firmware with parameters (3, times) about the trim angles [rad]."""
    return _TRANSFERS[model](lever, parameters, trim)


def _of_lever(lever: Lever, parameters: Array, trim: Array) -> Transfer:
    """About the trim the lever of firmware/THEORY.md is M θ̈ + D θ̇ + K θ = -l μ cos(trim) z̈.

    Where the trunk gives way by s on its seat, s̈ + 2 ζ ω ṡ + ω² s = -z̈, the arm adds l cos(trim) (c_p ṡ + k_p s).
    """
    m_p, c_p, k_p = parameters
    stiffness = lever.rotational_stiffness(trim, m_p, k_p, trim)
    resistance = np.column_stack((lever.total_inertia(m_p), lever.rotational_damping(trim, c_p), stiffness))
    forcing = (-lever.unbalance(m_p) * np.cos(trim))[:, np.newaxis]
    if lever.seat_frequency == 0.0:
        return Transfer(forcing, resistance)
    omega = 2.0 * np.pi * lever.seat_frequency
    trunk = np.array((1.0, 2.0 * lever.seat_damping_ratio * omega, omega**2))
    rise = (lever.length * np.cos(trim))[:, np.newaxis]
    arm = rise * np.column_stack((0.0 * c_p, c_p, k_p))
    return Transfer(forcing * trunk - arm, np.array([np.polymul(row, trunk) for row in resistance]))


def _of_linear_physical(_: Lever, parameters: Array, __: Array) -> Transfer:
    """Return the transfer function of m θ̈ + c θ̇ + k θ = m z̈."""
    return Transfer(parameters[0][:, np.newaxis], parameters.T)


def _of_linear_black_box(_: Lever, parameters: Array, __: Array) -> Transfer:
    """θ̈ - a22 θ̇ - a21 θ = b21 z̈."""
    a21, a22, b21 = parameters
    return Transfer(b21[:, np.newaxis], np.column_stack((np.ones_like(a21), -a22, -a21)))


def _of_hand(lever: Lever, parameters: Array, trim: Array) -> Transfer:
    """θ̈ + c_hand θ̇ + k_hand θ = -(z̈ + c_space ż) / (l cos(trim))."""
    k_hand, c_hand, c_space = parameters
    ones, forcing = np.ones_like(k_hand), -1.0 / (lever.length * np.cos(trim))
    return Transfer(
        forcing[:, np.newaxis] * np.column_stack((ones, c_space)),
        np.column_stack((ones, c_hand, k_hand, 0.0 * ones)),
    )


_TRANSFERS: Mapping[str, Callable[[Lever, Array, Array], Transfer]] = {
    "lever": _of_lever,
    "linear_physical": _of_linear_physical,
    "linear_black_box": _of_linear_black_box,
    "hand": _of_hand,
}


def magnitude_and_phase(response: ComplexArray) -> tuple[Array, Array]:
    """Return the magnitude and phase of a response over frequency.

    The phase [deg] goes on downwards, from -180 where the lever moves against the floor at first (the arm's weight does
    so), from 0 where it moves along.
    """
    start = -180.0 if response[0].real < 0.0 else 0.0
    along = response if start == 0.0 else -response
    return np.abs(response), np.degrees(np.unwrap(np.angle(along))) + start


def bands(
    frequency: Array, magnitude: Array, phase: Array, gain_sigma: Array, phase_sigma: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return low and high edge of a magnitude and of its phase [deg], by the standard deviations that are sent.

    Those are between the frequencies of FEEDTHROUGH by straight lines; beyond them the edges are NaN.
    """
    gain, angle = (np.interp(frequency, SENT, sigma, left=np.nan, right=np.nan) for sigma in (gain_sigma, phase_sigma))
    factor, half = np.exp(SIGMAS * gain), SIGMAS * np.degrees(angle)
    return (magnitude / factor, magnitude * factor), (phase - half, phase + half)


def slow_trim(time: Array, theta: Array, corner: float) -> Array:
    """Return the estimator's own idea of the trim angle [rad]: the slow part of θ, held over gaps (NaN).

    `corner`: [Hz].
    """
    trim = np.empty(len(theta))
    measured = theta[np.isfinite(theta)]
    level = Detrend(float(measured[0]) if measured.size else 0.0)
    for index, (gap, angle) in enumerate(zip(np.diff(time, prepend=time[0]).tolist(), theta.tolist(), strict=True)):
        if angle == angle:
            level.step(angle, corner, min(gap, LONGEST_STEP))
        trim[index] = level.level
    return trim
