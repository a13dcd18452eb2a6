"""Biodynamic feedthrough theta/z_ddot over the band of collective bounce, from the estimated parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..transfer import BAND
from .plant import FloatArray, Hardware

ComplexArray = NDArray[np.complex128]

FREQUENCIES = np.linspace(*BAND, 25)
"""[Hz]"""


def response(hardware: Hardware, parameters: FloatArray, trim: FloatArray) -> ComplexArray:
    """theta/z_ddot [rad/(m/s^2)] of [m_p, c_p, k_p] (..., 3) at a trim (...) [rad], at FREQUENCIES: (..., F)."""
    m_p, c_p, k_p = (parameters[..., i, None] for i in range(3))
    s: ComplexArray = 2j * np.pi * FREQUENCIES.astype(np.complex128)
    rise = hardware.length * np.cos(trim)[..., None]
    damping, stiffness = rise**2 * c_p + hardware.damping, rise**2 * k_p + hardware.stiffness
    resistance: ComplexArray = hardware.moving_inertia(m_p) * s**2 + damping * s + stiffness
    return -rise * hardware.forcing_mass(m_p) / resistance


def estimated(
    hardware: Hardware, parameters: FloatArray, sigma: FloatArray, correlation: FloatArray, trim: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """The response and the standard deviation of its complex error, root of E|error|^2, both (..., F).

    By central differences along each parameter, one standard deviation wide.
    """
    slopes = []
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1.0
        wide = 0.5 * np.minimum(sigma, parameters) * step
        slopes.append(response(hardware, parameters + wide, trim) - response(hardware, parameters - wide, trim))
    variance = sum(np.abs(slope) ** 2 for slope in slopes)
    for pair, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        variance = variance + 2.0 * correlation[..., pair, None] * np.real(slopes[i] * np.conj(slopes[j]))
    return response(hardware, parameters, trim), np.sqrt(np.maximum(variance, 0.0))
