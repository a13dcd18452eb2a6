"""What a firmware is given of an aircraft: its response from 1.5 to 8 Hz, where bounce is."""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.host_tools.firmware.aircraft import AircraftResponse

from .stability import Response

UNSURE = 0.05
"""How well it is known, where nothing else is said: standard deviation of gain [1] and phase [rad]."""
_TABLE = np.geomspace(1.5, 8.0, 24)


def known(response: Response, **said: Any) -> AircraftResponse:
    """The table of z_ddot / delta; `said` are those of AircraftResponse. Raises LeverError."""
    values = response(2j * np.pi * _TABLE.astype(np.complex128))
    sigmas = {"gain_sigma": UNSURE, "phase_sigma": UNSURE}
    return AircraftResponse(_TABLE.tolist(), values.tolist(), **{**sigmas, **said})
