"""θ/z̈ of the estimated model at this moment: the curve of its parameters, and the band that the estimator sends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..firmware.config import Config
from ..models.lever import Lever
from ..numeric.arrays import FloatArray
from ..report import bode
from .picture import Feedthrough

FREQUENCIES: FloatArray = np.geomspace(0.5, 12.0, 120)
"""[Hz]"""


class Response(NamedTuple):
    """Over FREQUENCIES."""

    magnitude: FloatArray
    """[deg per m/s²]"""
    low: FloatArray
    """Edges of its band; NaN where none is sent."""
    high: FloatArray
    phase: FloatArray
    """[deg], going on beyond ±180."""
    phase_low: FloatArray
    phase_high: FloatArray


class Geometry:
    """What the estimator knows of the lever, from its configuration."""

    def __init__(self, config: Config) -> None:
        self._lever = Lever.from_settings(config.settings, config.choices["preload"])

    def response(
        self, model: str, parameters: Sequence[float], trim: float, sent: Sequence[Feedthrough]
    ) -> Response | None:
        """Return the response of `model` with its parameters about the trim angle [rad]; None if any is not known.

        `sent` is FEEDTHROUGH, a value a frequency of it.
        """
        if not np.isfinite([*parameters, trim]).all():
            return None
        transfer = bode.transfer(model, self._lever, np.array(parameters)[:, np.newaxis], np.array([trim]))
        magnitude, phase = bode.magnitude_and_phase(transfer.response(FREQUENCIES)[0])
        magnitude = np.degrees(magnitude)
        sigmas = (np.array([entry.gain_sigma for entry in sent]), np.array([entry.phase_sigma for entry in sent]))
        of_magnitude, of_phase = bode.bands(FREQUENCIES, magnitude, phase, *sigmas)
        return Response(magnitude, *of_magnitude, phase, *of_phase)
