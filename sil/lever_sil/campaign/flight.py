"""A simulated flight: what the sensors said, sample by sample, and what was true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from lever_cdkf.firmware import quantities
from lever_cdkf.numeric.arrays import Array, BoolArray
from numpy.typing import NDArray

from ..fast.closed_loop import Loop, available
from ..run.summary import judged_samples
from ..scenarios import inputs as scenario_inputs
from ..scenarios.inputs import Inputs
from ..scenarios.scenario import Scenario

Columns = dict[str, NDArray[Any]]
"""Of lever_estimate_t and lever_health_t, at the samples that are looked at."""


@dataclass(frozen=True)
class Flight:
    """One flight of K samples, looked at T times."""

    scenario: Scenario
    at: NDArray[np.int64]
    """(T,) indices of the samples that are looked at."""
    truth: Array
    """(T, 5) parameters, NaN where the pilot has none of the model; natural frequency [Hz], damping ratio."""
    firmware: Columns
    """What the firmware that flew with it said."""
    measured: dict[str, Array]
    """(K,) each of theta, theta_dot, tau_m, z_ddot, and grip_force where there is one; NaN where it is missing. Empty
    where nobody asked for it."""

    @property
    def time(self) -> Array:
        """Return the times of the samples looked at, (T,) [s]."""
        time: Array = self.at * self.scenario.period
        return time

    @property
    def judged(self) -> BoolArray:
        """(T,) whether errors count: some time after the start and after each jump of the truth."""
        return judged_samples(self.scenario, self.time)


def simulate(scenario: Scenario, every: float, *, measured: bool) -> Flight:
    """Return a flight, looked at `every` so many seconds; raise LeverError.

    What was measured is in it if that is asked for.
    """
    inputs = scenario_inputs.prepare(scenario)
    step = max(1, round(every / scenario.period))
    loop = Loop(scenario, inputs, by_frames=False, every=step)
    loop.advance(len(inputs.time))
    loop.check()
    at = np.arange(0, len(inputs.time), step, dtype=np.int64)
    seen = inputs.truth.at(slice(None, None, step))
    values = {**seen.parameters, **vars(seen.dynamics)}
    names = [quantity.key for quantity in quantities.quantities(scenario.config.choices["model"])]
    truth = np.stack([values[name] if name in values else np.full(len(at), np.nan) for name in names], axis=-1)
    firmware = {name: array[name] for array in loop.outputs for name in array.dtype.names or ()}
    return Flight(scenario, at, truth, firmware, _measured(scenario, inputs, loop) if measured else {})


def _measured(scenario: Scenario, inputs: Inputs, loop: Loop) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    for name, signal in loop.signals.items():
        readings = scenario_inputs.readings(scenario, inputs, name)
        values = readings.sensor.measure(signal, scenario.period, scenario.stream(name))
        columns[name] = values if readings.corruption is None else readings.corruption.of(values)
        if name != "z_ddot":
            columns[name][inputs.missing["lever_frame"]] = np.nan
    columns.setdefault("z_ddot", inputs.base)
    return {name: available(name, values) for name, values in columns.items()}


def beside(flights: Sequence[Flight], name: str) -> Array:
    """Return (B, K) a measured column of flights of one length."""
    return np.stack([flight.measured[name] for flight in flights])
