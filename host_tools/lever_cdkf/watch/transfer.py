"""θ/z̈ of the estimated model at this moment: the curve of its parameters, and the band that the estimator sends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..firmware.config import Config
from ..firmware.estimator import FEEDTHROUGH_FREQUENCIES
from ..models.lever import Lever
from ..numeric.arrays import FloatArray
from ..report import bode
from .picture import Feedthrough

FREQUENCIES: FloatArray = np.geomspace(0.5, 12.0, 120)
"""[Hz]"""
SIGMAS = 2.0
"""The band reaches so many standard deviations to either side."""


@dataclass(frozen=True)
class Response:
    """Over FREQUENCIES."""

    magnitude: FloatArray
    """[deg per m/s²]"""
    factor: FloatArray
    """The band of the magnitude is from magnitude / factor to magnitude * factor; NaN where none is sent."""
    phase: FloatArray
    """[deg], going on beyond ±180."""
    phase_half_band: FloatArray
    """[deg]; NaN where none is sent."""


class Geometry:
    """What the estimator knows of the lever, from its configuration."""

    def __init__(self, config: Config) -> None:
        self._lever = Lever.from_settings(config.settings, config.choices["preload"])

    def response(
        self, model: str, parameters: Sequence[float], trim: float, sent: Sequence[Feedthrough]
    ) -> Response | None:
        """Return the response of `model` with its parameters about the trim angle [rad]; None if any is not known.

        The band is that of FEEDTHROUGH, a value a frequency of it, and between those by straight lines.
        """
        if not np.isfinite([*parameters, trim]).all():
            return None
        transfer = bode.transfer(model, self._lever, np.array(parameters)[:, np.newaxis], np.array([trim]))
        magnitude, phase = bode.magnitude_and_phase(transfer.response(FREQUENCIES)[0])
        return Response(
            magnitude=np.degrees(magnitude),
            factor=np.exp(SIGMAS * _over_frequencies([entry.gain_sigma for entry in sent])),
            phase=phase,
            phase_half_band=SIGMAS * np.degrees(_over_frequencies([entry.phase_sigma for entry in sent])),
        )


def _over_frequencies(values: Sequence[float]) -> FloatArray:
    return np.interp(FREQUENCIES, FEEDTHROUGH_FREQUENCIES, values, left=np.nan, right=np.nan)
