"""A scenario in real time, over and over, with the estimator in the loop: a source of frames like a bus."""

from __future__ import annotations

import dataclasses
import time

import can
import numpy as np
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray
from lever_cdkf.watch.sources import Source, as_frame

from ..plants.truth import Truth
from ..scenarios.scenario import Scenario, load
from . import loop


class SimulationSource(Source):
    """The pilot of a scenario on his lever. When the scenario is over it begins again, with other random numbers."""

    takes_commands = True
    simulated = True

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self.title = f"simulation of {scenario.name}"
        self.scenario = scenario
        self._bus = _HeardBus(self)
        self._truth: tuple[float, Truth] | None = None  # when the run began by the clock, and what is true in it

    def run(self) -> None:
        """Simulate the scenario in real time until stopped, each time with the next seed."""
        scenario = self.scenario
        while not self._stopping.is_set():
            self._truth = time.monotonic(), scenario.truth(scenario.time())
            try:
                loop.run(scenario, self._bus, realtime=True, progress=self._look_up, commander=self._commander)
            except _Stopped:
                return
            scenario = dataclasses.replace(scenario, seed=scenario.seed + 1)
            self.run_number += 1

    def stop(self) -> None:
        """Stop the simulation and close its bus."""
        super().stop()
        self._bus.shutdown()

    def _transmit(self, identifier: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))

    def truth(self, frequencies: FloatArray) -> tuple[dict[str, float], ComplexArray] | None:
        """Return the true values now by name, and theta/z_ddot at `frequencies` [Hz]; None before the first run."""
        if self._truth is None:
            return None
        start, truth = self._truth
        columns = {**truth.parameters, **vars(truth.dynamics)}
        last = len(truth.rest) - 1
        sample = min(last, int((time.monotonic() - start) / self.scenario.period))
        values = {name: float(column[sample]) for name, column in columns.items()}
        return values, truth.transfer(np.array([sample])).response(frequencies)[0]

    def hear(self, message: can.Message) -> None:
        """Take a frame that passes on the bus of the simulation."""
        self._put(as_frame(message))

    def _look_up(self, _done: int, _total: int) -> None:
        if self._stopping.is_set():
            raise _Stopped


def open_source(name: str) -> tuple[Source, Config]:
    """Return the pilot of a scenario and the configuration of its estimator. Raise ScenarioError."""
    scenario = load(name)
    return SimulationSource(scenario), scenario.config


class _Stopped(Exception):  # noqa: N818
    """Ends a run half-way."""


class _HeardBus(LeverBus):
    """The firmware in this process, heard by a source both ways."""

    def __init__(self, source: SimulationSource) -> None:
        scenario = source.scenario
        super().__init__("simulation", config=scenario.config, aircraft=scenario.known_aircraft)
        self._source = source

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._source.hear(msg)
        super().send(msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        message = super().recv(timeout)
        if message is not None:
            self._source.hear(message)
        return message
