"""What the tests of the simulation share."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from lever_cdkf.host_tools import codec
from lever_cdkf.host_tools.bus import LeverBus
from lever_cdkf.sil import scenario
from lever_cdkf.sil.scenario import Scenario


class PuppetBus(can.BusABC):
    """An estimator made of strings: after each BASE_SAMPLE it sends what `answers`, called with the sample's number,
    returns as (message, values), or nothing. `sent` are the frames that it got."""

    def __init__(self, answers: Callable[[int], list[tuple[str, dict[str, Any]]]]) -> None:
        super().__init__("puppet")
        self.channel_info = "puppet"
        self.sent: list[tuple[int, bytes]] = []
        self._answers = answers
        self._queue: deque[can.Message] = deque()
        self._samples = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append((msg.arbitration_id, bytes(msg.data)))
        if msg.arbitration_id == codec.message("BASE_SAMPLE").frame_id:
            for name, values in self._answers(self._samples):
                model = {} if name.endswith("_SAMPLE") else {"model": "lever"}
                data = codec.encode(name, self._samples, model | values)
                identifier = codec.message(name).frame_id
                self._queue.append(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
            self._samples += 1

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self._queue.popleft() if self._queue else None

    def decoded(self, name: str) -> list[dict[str, float]]:
        """The contents of the frames it got of one message."""
        wanted = codec.message(name).frame_id
        return [codec.decode(identifier, data)[1] for identifier, data in self.sent if identifier == wanted]


def estimate(theta: float = 0.0, theta_dot: float = 0.0, nis: float = 2.0) -> tuple[str, dict[str, Any]]:
    """A STATE_ESTIMATE for a PuppetBus."""
    return "STATE_ESTIMATE", {"theta": theta, "theta_dot": theta_dot, "nis": nis}


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
