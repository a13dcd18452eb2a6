"""The helicopter of aircraft/flight.py as c/aircraft.h takes it."""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from ..aircraft.flight import Flight
from .library import Struct


def fill(struct: Struct, given: Any, flight: Flight, correction: FloatArray) -> None:
    """Put one in hover into an aircraft_t in a struct; `correction` gets what corrects the lever, a value a sample."""
    for name, value in vars(flight.constants).items():
        setattr(given, name, struct.doubles(np.array(value)) if name in ("step", "output") else value)
    given.states = len(flight.constants.step)
    count = len(flight.gust)
    given.gust, given.gearing = struct.doubles(flight.gust), struct.doubles(np.full(count, flight.gearing))
    given.lever, given.correction = struct.doubles(np.zeros(count)), struct.doubles(correction)
