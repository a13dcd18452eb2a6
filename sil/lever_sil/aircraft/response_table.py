"""What a firmware is given of an aircraft: its response from 1.5 to 8 Hz, where bounce is."""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import AircraftResponse

from .stability import Response

UNSURE = 0.05
"""How well it is known, where nothing else is said: standard deviation of gain [1] and phase [rad]."""
BAND = (1.5, 8.0)
"""Of the table [Hz]."""
_NEEDED = (2.0, 7.0)
"""Of it at least, so that it has the crossing of the loop [Hz]."""
_POINTS = 24


def response_table(response: Response, band: tuple[float, float] = BAND, **said: Any) -> AircraftResponse:
    """The table of z_ddot / delta, which is known in `band` [Hz]; `said` are those of AircraftResponse. Raises
    LeverError."""
    low, high = max(band[0], BAND[0]), min(band[1], BAND[1])
    if low > _NEEDED[0] or high < _NEEDED[1]:
        raise LeverError(
            f"the response is from {band[0]:g} to {band[1]:g} Hz; the margin to bounce needs it from {_NEEDED[0]:g} to "
            f"{_NEEDED[1]:g} Hz at least, better from {BAND[0]:g} to {BAND[1]:g} Hz (frequencies are in Hz, not rad/s)"
        )
    table = np.geomspace(low, high, _POINTS)
    values = response(2j * np.pi * table.astype(np.complex128))
    sigmas = {"gain_sigma": UNSURE, "phase_sigma": UNSURE}
    return AircraftResponse(table.tolist(), values.tolist(), **{**sigmas, **said})
