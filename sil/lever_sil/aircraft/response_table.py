"""What a firmware is given of an aircraft: its response from 1.5 to 8 Hz, where bounce is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.aircraft import ALARM, WARNING, AircraftResponse, SeatTransfer
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray

from .aircraft import Coupled
from .stability import Response
from .state_space import SEAT, SENSOR
from .tabulated import Tabulated
from .vector_fitting import Fit, fit

UNSURE = 0.05
"""How well it is known, where nothing else is said: standard deviation of gain [1] and phase [rad]."""
BAND = (1.5, 8.0)
"""Of the table [Hz]."""
_NEEDED = (2.0, 7.0)
"""Of it at least, so that it has the crossing of the loop [Hz]."""
_POINTS = 24
LEFT = 1.5
"""[dB]"""
_OFF = 0.05
"""Of straight lines between the points of a table, relative to the response [1]."""
_SEAT_MODES = 3
_AT_SEAT = 1e-6
"""By which seat and accelerometer may differ and be one place."""


def known_response(coupled: Coupled, off: Response | None = None, **said: Any) -> AircraftResponse:
    """Return what a firmware is told of an aircraft.

    It is the response at the seat and the way from the accelerometer to there, or where that is not known, the response
    at the accelerometer. `off`: both are wrong by a factor; the one of the way is `seat_off` in `said`.
    """
    craft, factor = coupled.aircraft, off or (lambda s: np.ones_like(s))
    seat_off: Response = said.pop("seat_off", factor)
    s = 2j * np.pi * np.geomspace(1.0, 10.0, 60).astype(np.complex128)
    between = craft.seat_transfer(s)
    apart = bool(np.any(np.abs(between - 1.0) > _AT_SEAT))
    told = apart and craft.seat_transfer_known == "yes"
    place = SENSOR if apart and not told else SEAT
    seat = seat_modes(s, between * seat_off(s)) if told else None
    return response_table(lambda s: coupled.response(s, place) * factor(s), name=coupled.name, seat=seat, **said)


def measured_response(measured: Tabulated, **said: Any) -> AircraftResponse:
    """Return the same of a frequency response, as it was measured."""
    s = 2j * np.pi * measured.frequency.astype(np.complex128)
    seat = None if measured.seat is None else seat_modes(s, measured.seat)
    return response_table(measured.response, measured.band, seat=seat, **said)


def seat_modes(s: ComplexArray, between: ComplexArray) -> SeatTransfer:
    """Return the acceleration at the seat over that at the accelerometer as the firmware takes it.

    It is fitted at s [rad/s] on the imaginary axis.
    """
    return _modes(fit(s, between, _SEAT_MODES))


def _modes(fitted: Fit) -> SeatTransfer:
    """Return the modes of a fit: its poles two by two, r / (s - p) + q / (s - o).

    A real one that is left over counts twice, with a zero there.
    """
    system = fitted.system
    poles, vectors = np.linalg.eig(system.a)
    residues = (system.c @ vectors)[0] * np.linalg.solve(vectors, system.b.astype(np.complex128))[:, 0]
    known = list(zip(poles.astype(np.complex128).tolist(), residues.tolist(), strict=True))
    pairs = [((p, r), (p.conjugate(), r.conjugate())) for p, r in known if p.imag > 0.0]
    real = [each for each in known if each[0].imag == 0.0]
    real += [(real[-1][0], 0.0)] if len(real) % 2 else []
    pairs += list(zip(real[::2], real[1::2], strict=True))
    modes = [((r + q).real, -(r * o + q * p).real, -(p + o).real, (p * o).real) for (p, r), (o, q) in pairs]
    return SeatTransfer(float(system.d[0, 0]), modes)


def response_table(response: Response, band: tuple[float, float] = BAND, **said: Any) -> AircraftResponse:
    """Return the table of z_ddot / delta, which is known in `band` [Hz]; raise LeverError.

    `said` are those of AircraftResponse.
    """
    low, high = max(band[0], BAND[0]), min(band[1], BAND[1])
    if low > _NEEDED[0] or high < _NEEDED[1]:
        raise LeverError(
            f"the response is from {band[0]:g} to {band[1]:g} Hz; the margin to bounce needs it from {_NEEDED[0]:g} to "
            f"{_NEEDED[1]:g} Hz at least, better from {BAND[0]:g} to {BAND[1]:g} Hz (frequencies are in Hz, not rad/s)"
        )
    table = _frequencies(response, low, high)
    values = response(2j * np.pi * table.astype(np.complex128))
    sigmas = {"gain_sigma": UNSURE, "phase_sigma": UNSURE, **said}
    alarm = alarm_limit(sigmas["gain_sigma"])
    limits = {"alarm": alarm, "warning": alarm + WARNING - ALARM}
    return AircraftResponse(table.tolist(), values.tolist(), **{**limits, **sigmas})


def _frequencies(response: Response, low: float, high: float) -> FloatArray:
    """Return the frequencies of the table [Hz], which are in equal ratios.

    Where a mode of the fuselage lies between two of them, each further one is where straight lines between the ones
    before are furthest off.
    """
    fine = np.geomspace(low, high, 1000)
    exact = response(2j * np.pi * fine.astype(np.complex128))

    def off(table: FloatArray) -> FloatArray:
        values = response(2j * np.pi * table.astype(np.complex128))
        lines = np.interp(fine, table, values.real) + 1j * np.interp(fine, table, values.imag)
        error: FloatArray = np.abs(lines / exact - 1.0)
        return error

    table = np.geomspace(low, high, _POINTS)
    if off(table).max() > _OFF:
        table = fine[[0, -1]]
        while len(table) < _POINTS:
            table = np.sort(np.append(table, fine[np.argmax(off(table))]))
    return table


def alarm_limit(gain_sigma: float) -> float:
    """Return the gain margin below which there is an alarm where nothing else is said [dB].

    With a gain that is too small by gain_sigma [1], LEFT of it are left then.
    """
    return max(ALARM, LEFT - 20.0 * math.log10(1.0 - min(gain_sigma, 0.9)))
