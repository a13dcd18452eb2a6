"""What the tests of the simulation share."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from lever_cdkf.host_tools import codec
from lever_cdkf.host_tools.bus import LeverBus
from lever_cdkf.host_tools.library import enum_names
from lever_cdkf.sil import scenario
from lever_cdkf.sil.scenario import Scenario


class PuppetBus(can.BusABC):
    """An estimator made of strings: after each BASE_SAMPLE it sends what `answers`, called with the sample's number,
    returns as (message, values), or nothing; the time in them is that of the sample unless they say otherwise. COMMANDs
    get the result that `results` has next, then "accepted"; without a result there is no answer. `sent` are the frames
    that it got."""

    def __init__(
        self, answers: Callable[[int], list[tuple[str, dict[str, Any]]]], results: Iterable[str | None] = ()
    ) -> None:
        super().__init__("puppet")
        self.channel_info = "puppet"
        self.sent: list[tuple[int, bytes]] = []
        self._answers = answers
        self._results = iter(results)
        self._queue: deque[can.Message] = deque()
        self._samples = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append((msg.arbitration_id, bytes(msg.data)))
        if msg.arbitration_id == codec.message("BASE_SAMPLE").frame_id:
            time_us = codec.decode(msg.arbitration_id, msg.data)[1]["time_us"]
            for name, values in self._answers(self._samples):
                fields = {signal.name for signal in codec.message(name).signals if signal.multiplexer_ids is None}
                defaults = {"model": "lever", "valid": 1, "time_low": time_us % 65536}
                self._put(name, {key: value for key, value in defaults.items() if key in fields} | values)
            self._samples += 1
        elif msg.arbitration_id == codec.message("COMMAND").frame_id:
            result = next(self._results, "accepted")
            if result is not None:
                choices = {"model": 0, "preload": 0, "estimator": 0, "adaptation": 0, "dither_rms": 0.0}
                self._put("COMMAND_ACK", {"command_counter": msg.data[1] & 15, "result": result, **choices})

    def _put(self, name: str, values: dict[str, Any]) -> None:
        data = codec.encode(name, self._samples, values)
        identifier = codec.message(name).frame_id
        self._queue.append(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self._queue.popleft() if self._queue else None

    def decoded(self, name: str) -> list[dict[str, float]]:
        """The contents of the frames it got of one message."""
        wanted = codec.message(name).frame_id
        return [codec.decode(identifier, data)[1] for identifier, data in self.sent if identifier == wanted]


def estimate(
    theta: float = 0.0, theta_dot: float = 0.0, innovation: float | None = 1.5, **more: float
) -> tuple[str, dict[str, Any]]:
    """A STATE_ESTIMATE for a PuppetBus."""
    return "STATE_ESTIMATE", {"theta": theta, "theta_dot": theta_dot, "innovation": innovation, **more}


def health(mode: str = "run", *faults: str, restarts: int = 0, excitation: float = 0.1) -> tuple[str, dict[str, Any]]:
    """A HEALTH for a PuppetBus."""
    flags = {f"fault_{name}": int(name in faults) for name in enum_names("lever_fault").values()}
    return "HEALTH", {"mode": mode, "restarts": restarts, "excitation": excitation, **flags}


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Scenario]:
    """load(text, *overrides): the scenario of a TOML text."""

    def from_text(text: str, *overrides: str) -> Scenario:
        file = tmp_path / "made.toml"
        file.write_text(text)
        return scenario.load(str(file), overrides)

    return from_text


@pytest.fixture
def short() -> Scenario:
    """Half a second of the steady scenario."""
    return scenario.load("steady", ["duration=0.5 s", "converged_after=0.1 s"])


@pytest.fixture
def lever_bus() -> Iterator[Callable[[Scenario], LeverBus]]:
    """lever_bus(scenario): the firmware in this process, configured for it."""
    buses: list[LeverBus] = []

    def make(wanted: Scenario) -> LeverBus:
        buses.append(LeverBus("lever", config=wanted.config))
        return buses[-1]

    yield make
    for bus in buses:
        bus.shutdown()
