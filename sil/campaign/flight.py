"""A simulated flight: what the sensors said, sample by sample, and what was true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.host_tools.arrays import Array, BoolArray
from lever_cdkf.host_tools.can.bus import LeverBus
from lever_cdkf.host_tools.firmware import quantities
from numpy.typing import NDArray

from ..run import loop
from ..run.columns import columns_of
from ..run.summary import judged_samples
from ..scenarios.scenario import Scenario

MEASURED = ("theta", "theta_dot", "z_ddot", "tau_m")
_COLUMNS = ("theta_measured_rad", "theta_dot_measured_rad_s", "z_ddot_measured_m_s2", "tau_m_measured_N_m")


@dataclass(frozen=True)
class Flight:
    """One flight of K samples, looked at T times."""

    scenario: Scenario
    measured: dict[str, Array]
    """(K,) each of MEASURED; NaN where it is missing."""
    at: NDArray[np.int64]
    """(T,) indices of the samples that are looked at."""
    truth: Array
    """(T, 5) parameters, NaN where the pilot has none of the model; natural frequency [Hz], damping ratio."""

    @property
    def time(self) -> Array:
        """(T,) [s]"""
        time: Array = self.at * self.scenario.period
        return time

    @property
    def judged(self) -> BoolArray:
        """(T,) whether errors count: some time after the start and after each jump of the truth."""
        return judged_samples(self.scenario, self.time)


def simulate(scenario: Scenario, every: float) -> Flight:
    """A flight, looked at `every` so many seconds. Raises LeverError."""
    with LeverBus(f"campaign {scenario.name}", config=scenario.config) as bus:
        recording = loop.run(scenario, bus)
    trace = columns_of(recording, recording.frames())
    at = looked_at(scenario, every)
    model = scenario.config.choices["model"]
    names = [quantity.column("true") for quantity in quantities.quantities(model)]
    truth = np.stack([trace[name][at] if name in trace else np.full(len(at), np.nan) for name in names], axis=-1)
    return Flight(scenario, {name: trace[column] for name, column in zip(MEASURED, _COLUMNS, strict=True)}, at, truth)


def looked_at(scenario: Scenario, every: float) -> NDArray[np.int64]:
    """(T,) samples, the last one among them."""
    step = max(1, round(every / scenario.period))
    count = len(scenario.time())
    return np.arange((count - 1) % step, count, step, dtype=np.int64)


def beside(flights: Sequence[Flight], name: str) -> Array:
    """(B, K) a measured column of flights of one length."""
    return np.stack([flight.measured[name] for flight in flights])
