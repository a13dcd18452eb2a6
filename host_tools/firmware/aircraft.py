"""What an estimator is given of the helicopter, to tell how near collective bounce is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import LeverError
from .library import ffi, lib

if TYPE_CHECKING:
    from collections.abc import Sequence

WARNING, ALARM = 4.5, 3.0
"""Gain margins below which there is a warning and an alarm, where nothing else is said [dB]."""


class Stability(NamedTuple):
    """lever_stability_t: how near the loop through arm, lever and rotor is to instability."""

    state: str
    """A name of enum_names("lever_bounce")."""
    gain_margin: float
    """By which the loop may grow until it is unstable [dB]."""
    gain_margin_sigma: float
    modulus: float
    """Least |1 - L| of the loop L, negative where it is unstable [1]."""
    modulus_sigma: float
    frequency: float
    """At which it becomes unstable [Hz]."""
    frequency_sigma: float


class Correction(NamedTuple):
    """lever_correction_t: what mitigation adds to the lever's angle where that becomes collective pitch."""

    angle: float
    """[rad]"""
    weight: float
    """Of the fade that is in it: 0 passive, 1 all of it."""


class AircraftResponse:
    """lever_aircraft_t: how a helicopter answers to its collective lever, at 3 to 24 frequencies."""

    def __init__(
        self,
        frequency: Sequence[float],
        response: Sequence[complex],
        *,
        gain_sigma: float,
        phase_sigma: float,
        warning: float = WARNING,
        alarm: float = ALARM,
    ) -> None:
        """frequency [Hz], rising; response: vertical acceleration of the cabin over the lever's angle, with gearing,
        delays and actuator [(m/s²)/rad]; how well that is known: gain_sigma relative to it [1], phase_sigma [rad];
        warning and alarm: limits of the gain margin [dB]. Raises LeverError."""
        most = lib.LEVER_AIRCRAFT_POINTS
        if len(frequency) != len(response) or not 3 <= len(frequency) <= most:
            raise LeverError(f"the response of an aircraft has 3 to {most} frequencies, and a value at each")
        self.pointer: Any = ffi.new("lever_aircraft_t *")
        """For calls of `lib`; valid as long as this object."""
        self.pointer.count = len(frequency)
        for i, (at, value) in enumerate(zip(frequency, response, strict=True)):
            self.pointer.frequency[i] = at
            self.pointer.real[i], self.pointer.imaginary[i] = value.real, value.imag
        self.pointer.gain_sigma, self.pointer.phase_sigma = gain_sigma, phase_sigma
        self.pointer.warning, self.pointer.alarm = warning, alarm
