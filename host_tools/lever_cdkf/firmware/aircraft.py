"""The description of the helicopter by which an estimator tells how near collective bounce is.

It is also a file, which lever_can reads as well (firmware/port/linux/aircraft.h says what is in it).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import LeverError
from ..text.units import number_of
from .library import ffi, lib
from .settings_file import lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

WARNING, ALARM = 5.0, 4.0
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


class SeatTransfer(NamedTuple):
    """z_ddot at the pilot's seat over that at the accelerometer.

    It is direct + sum (by_rate s + by_place) / (s^2 + damping s + stiffness), at most LEVER_SEAT_MODES of them.
    """

    direct: float
    modes: Sequence[tuple[float, float, float, float]]
    """by_rate, by_place, damping, stiffness [1/s, 1/s², 1/s, 1/s²]."""


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
        seat: SeatTransfer | None = None,
        name: str = "an aircraft",
    ) -> None:
        """Take the response of an aircraft; raise LeverError.

        frequency [Hz], rising; response: vertical acceleration at the pilot's seat over the lever's angle, with
        gearing, delays and actuator [(m/s²)/rad]; how well that is known: gain_sigma relative to it [1], phase_sigma
        [rad]; warning and alarm: limits of the gain margin [dB]; seat: where the accelerometer is not there, what lies
        between, and None where that is not known: then the response is that at the accelerometer; name: what it is of,
        for people.
        """
        self.name = name
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
        if seat is not None:
            if not 1 <= len(seat.modes) <= lib.LEVER_SEAT_MODES:
                raise LeverError(f"between accelerometer and seat there are 1 to {lib.LEVER_SEAT_MODES} modes")
            self.pointer.seat_modes, self.pointer.seat_direct = len(seat.modes), seat.direct
            for i, mode in enumerate(seat.modes):
                for name, value in zip(_MODE, mode, strict=True):
                    setattr(self.pointer.seat[i], name, value)

    @property
    def warning(self) -> float:
        """Return the gain margin below which there is a warning [dB]."""
        return round(float(self.pointer.warning), 6)

    @property
    def alarm(self) -> float:
        """Return the gain margin below which there is an alarm [dB]."""
        return round(float(self.pointer.alarm), 6)

    def seat_modes(self) -> list[tuple[float, ...]]:
        """Return by_rate, by_place, damping and stiffness of each mode between accelerometer and seat."""
        modes = (self.pointer.seat[i] for i in range(self.pointer.seat_modes))
        return [tuple(float(getattr(mode, name)) for name in _MODE) for mode in modes]

    def text(self) -> str:
        """Return the content of its file."""
        at = self.pointer
        lines = [
            f"# {self.name}",
            "# frequency [Hz], real and imaginary part of z_ddot over the lever's angle [(m/s^2)/rad]",
        ]
        lines += [f"{at.frequency[i]:.6g}  {at.real[i]:.6g}  {at.imaginary[i]:.6g}" for i in range(at.count)]
        lines += [f"{name} = {getattr(at, name):.6g}  # {unit}" for name, unit in _NUMBERS.items()]
        if at.seat_modes:
            lines += [
                f"{_DIRECT} = {at.seat_direct:.9g}  # [1]; z_ddot at the seat over that at the accelerometer: this,"
            ]
            lines += [
                "# and by_rate [1/s], by_place [1/s²], damping [1/s] and stiffness [1/s²] of each mode between them"
            ]
            lines += [f"{_SEAT}  " + "  ".join(f"{each:.9g}" for each in mode) for mode in self.seat_modes()]
        return "\n".join(lines) + "\n"


def read_response(path: str) -> AircraftResponse:
    """Return the response of an aircraft in a file. Raise LeverError."""
    points: list[list[float]] = []
    modes: list[list[float]] = []
    numbers: dict[str, float] = {}
    for place, text in lines_of(path):
        name, equals, value = (part.strip(" \t") for part in text.partition("="))
        words = [value] if equals else text.replace("\t", " ").split()
        is_mode = not equals and words[:1] == [_SEAT]
        cells = [number_of(word) for word in words[is_mode:]]
        is_entry = len(cells) == 1 and name in (*_NUMBERS, _DIRECT) and name not in numbers
        if not (is_entry if equals else len(cells) == (len(_MODE) if is_mode else 3)) or any(map(math.isnan, cells)):
            raise LeverError(
                f"{place}: neither {', '.join(_NUMBERS)}, {_DIRECT} = number, each once, nor frequency, real and "
                f"imaginary part, nor {_SEAT} and four numbers; `lever aircraft FILE.csv -o FILE.response` makes such "
                "a file of a CSV one"
            )
        if equals:
            numbers[name] = cells[0]
        else:
            (modes if is_mode else points).append(cells)
    if lacking := [name for name in ("gain_sigma", "phase_sigma") if name not in numbers]:
        raise LeverError(f"{path}: how well is it known? It needs a line {lacking[0]} = number")
    try:
        values = [complex(*each[1:]) for each in points]
        direct = numbers.pop(_DIRECT, None)
        if (direct is None) != (not modes):
            raise LeverError(f"{_DIRECT} and lines that begin with {_SEAT} go together")
        seat = None if direct is None else SeatTransfer(direct, [(a, b, c, d) for a, b, c, d in modes])
        return AircraftResponse([each[0] for each in points], values, **numbers, seat=seat, name=path)
    except LeverError as error:
        raise LeverError(f"{path}: {error}") from None


_DIRECT, _SEAT = "seat_direct", "seat"
_MODE = ("by_rate", "by_place", "damping", "stiffness")
_NUMBERS = {"gain_sigma": "[1]", "phase_sigma": "[rad]", "warning": "[dB]", "alarm": "[dB]"}
