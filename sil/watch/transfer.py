"""θ/z̈ of the estimated model at this moment, with the band that the estimator's standard deviations make of it.

Every model of the firmware answers the base by  θ/z̈ = b / (s² + 2 ζ ω s + ω²).  Frames carry the standard deviations
of ω and ζ, which are what is known well, and those of the parameters, from which that of the gain b follows; they do
not carry the correlations between them, so the three count as independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.host_tools.config import Config
from numpy.typing import NDArray

from ..oracle.lever import Lever
from ..report import bode

FloatArray = NDArray[np.float64]

FREQUENCIES: FloatArray = np.geomspace(0.5, 12.0, 120)
"""[Hz]"""
SIGMAS = 2.0
"""The band reaches so many standard deviations to either side."""
_DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class Response:
    """Over FREQUENCIES."""

    magnitude: FloatArray
    """[deg per m/s²]"""
    factor: FloatArray
    """The band of the magnitude is from magnitude / factor to magnitude * factor."""
    phase: FloatArray
    """[deg], going on beyond ±180."""
    phase_half_band: FloatArray
    """[deg]"""


class Geometry:
    """What the estimator knows of the lever, from its configuration."""

    def __init__(self, config: Config) -> None:
        self._lever = Lever.from_settings(config.settings, config.choices["preload"])

    def response(
        self,
        model: str,
        parameters: Sequence[float],
        sigmas: Sequence[float],
        dynamics_sigmas: tuple[float, float],
        trim: float,
    ) -> Response | None:
        """The response of `model` with its parameters about the trim angle [rad]; None if anything is not known.

        dynamics_sigmas: of the natural frequency [Hz] and the damping ratio [1].
        """
        if not np.isfinite([*parameters, *sigmas, *dynamics_sigmas, trim]).all():
            return None
        gain, damping, stiffness = self._coefficients(model, parameters, trim)
        if stiffness <= 0.0 or gain == 0.0:
            return None  # it does not swing: there is no ω
        w, w_n = 2.0 * np.pi * FREQUENCIES, np.sqrt(stiffness)
        zeta = damping / (2.0 * w_n)
        denominator = w_n**2 - w**2 + 2j * zeta * w_n * w
        # ln(θ/z̈) = ln b - ln(denominator); real part: logarithm of the magnitude, imaginary part: phase
        by_frequency = -(2.0 * w_n + 2j * zeta * w) / denominator * (2.0 * np.pi * dynamics_sigmas[0])
        by_damping = -(2j * w_n * w) / denominator * dynamics_sigmas[1]
        by_gain = self._gain_sigma(model, parameters, sigmas, trim) / gain
        log_sigma = np.sqrt(by_frequency.real**2 + by_damping.real**2 + by_gain**2)
        start = -180.0 if gain < 0.0 else 0.0
        return Response(
            magnitude=_DEGREES * np.abs(gain / denominator),
            factor=np.exp(SIGMAS * log_sigma),
            phase=start - np.degrees(np.angle(denominator)),
            phase_half_band=SIGMAS * _DEGREES * np.hypot(by_frequency.imag, by_damping.imag),
        )

    def _coefficients(self, model: str, parameters: Sequence[float], trim: float) -> tuple[float, float, float]:
        """b, 2 ζ ω and ω²."""
        found = bode.transfer(model, self._lever, np.array(parameters)[:, np.newaxis], np.array([trim]))
        denominator = found.denominator[0]
        return (
            float(found.numerator[0, -1] / denominator[0]),
            float(denominator[1] / denominator[0]),
            float(denominator[2] / denominator[0]),
        )

    def _gain_sigma(self, model: str, parameters: Sequence[float], sigmas: Sequence[float], trim: float) -> float:
        """The standard deviation of b, from those of the parameters, by central differences."""
        variance = 0.0
        for index, sigma in enumerate(sigmas):
            step = min(sigma, 0.1 * abs(parameters[index])) or 1e-9  # b is smooth: a small step has the same slope
            ends = []
            for side in (step, -step):
                moved = list(parameters)
                moved[index] += side
                ends.append(self._coefficients(model, moved, trim)[0])
            variance += ((ends[0] - ends[1]) / (2.0 * step) * sigma) ** 2
        return float(np.sqrt(variance))
