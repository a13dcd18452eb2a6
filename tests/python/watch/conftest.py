"""What the tests of the live views share: frames of an estimator that sees a swinging lever."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.commander import Commander
from lever_cdkf.firmware.config import Config
from lever_cdkf.watch.picture import Frame
from lever_cdkf.watch.sources import as_frame
from python.conftest import swing

LEVER = [sys.executable, "-m", "lever_cdkf.cli.main"]


class Flight:
    """An estimator on a bus, fed with a swinging lever at 1 kHz."""

    def __init__(self, config: Config | None = None) -> None:
        self.bus = LeverBus("flight", config=config, receive_own_messages=True)
        self.sample = 0
        self._commander = Commander()

    def messages(self, count: int) -> list[can.Message]:
        """Return all that passes on the bus during `count` more samples."""
        for sample in swing(self.sample, count):
            for frame in sample:
                self.send(*frame)
        self.sample += count
        return list(iter(lambda: self.bus.recv(0.0), None))

    def frames(self, count: int) -> list[Frame]:
        return [as_frame(message) for message in self.messages(count)]

    def command(self, values: Mapping[str, codec.Value]) -> None:
        """Send a COMMAND as the only sender."""
        self._commander.send(values, self.send)

    def send(self, identifier: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))


@pytest.fixture
def make_flight() -> Iterator[Callable[..., Flight]]:
    """Flight, whose bus is shut down after the test."""
    flights: list[Flight] = []

    def make(config: Config | None = None) -> Flight:
        flights.append(Flight(config))
        return flights[-1]

    yield make
    for flight in flights:
        flight.bus.shutdown()


@pytest.fixture
def flight(make_flight: Callable[..., Flight]) -> Flight:
    """With the firmware's defaults."""
    return make_flight()


@pytest.fixture
def log(flight: Flight, tmp_path: Path) -> Path:
    """Return a recording of 600 ms."""
    path = tmp_path / "flight.log"
    with can.CanutilsLogWriter(path, channel="can0") as writer:
        for message in flight.messages(600):
            message.channel = None
            writer.on_message_received(message)
    return path


@pytest.fixture
def start_lever() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start the command `lever`, which is ended after the test if it has not ended by itself."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> subprocess.Popen[str]:
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        started.append(subprocess.Popen([*LEVER, *arguments], text=True, **pipes))  # type: ignore[call-overload]
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
