"""Live views of a bus with other messages: frames of CAN FD, and the page of `lever live`."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import cantools.database
import numpy as np
import pytest
from can.interfaces import BACKENDS
from can.interfaces.virtual import VirtualBus
from cantools.database.can import Database
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import Config
from lever_cdkf.runtime.exit_status import INTERRUPTED
from lever_cdkf.signals.mapping import read_mapping
from lever_cdkf.signals.online import Online
from lever_cdkf.watch.mapped import MappedBusSource
from lever_cdkf.watch.picture import Picture
from processes import PATIENCE
from python.signals.flight import GRAVITY, MAPPED, NATURAL_FREQUENCY, Flight
from python.signals.test_mapped_replay import frequency, replayed
from tornado.websocket import WebSocketClientConnection, websocket_connect

FD = """VERSION ""
BU_: FCC

BO_ 2566844928 Everything: 24 FCC
 SG_ Angle : 64|16@1- (0.005,0) [-90|90] "deg" FCC
 SG_ Rate : 96|16@1- (0.05,0) [-1600|1600] "deg/s" FCC
 SG_ Acceleration : 160|16@1- (0.0002,0) [-6|6] "g" FCC

BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","StandardCAN_FD","ExtendedCAN_FD";
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";
BA_ "VFrameFormat" BO_ 2566844928 3;
"""
FD_MAPPED = ("theta=Angle", "theta_dot=Rate", "z_ddot=Acceleration")
SENT = 5000  # frames: 10 s


@pytest.fixture(scope="module")
def fd_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fd") / "fd.dbc"
    path.write_text(FD)
    return path


@pytest.fixture(scope="module")
def fd_frames(flight: Flight) -> list[can.Message]:
    database = cantools.database.load_string(FD)
    assert isinstance(database, Database)
    message = database.get_message_by_name("Everything")
    columns = np.column_stack((np.degrees(flight.theta), np.degrees(flight.theta_dot), 1.0 + flight.z_ddot / GRAVITY))
    return [
        can.Message(
            *(1000.0 + at, message.frame_id, True),
            is_fd=True,
            bitrate_switch=True,
            channel=0,
            data=message.encode(dict(zip(("Angle", "Rate", "Acceleration"), values, strict=True))),
        )
        for at, values in zip(flight.time[:SENT].tolist(), columns[:SENT].tolist(), strict=True)
    ]


def shown(source: MappedBusSource, frames: list[can.Message], other_end: can.BusABC) -> Picture:
    """Return what a view knows when all frames have come."""
    picture = Picture()
    source.start()
    try:
        for frame in frames:
            other_end.send(frame)
        deadline = time.monotonic() + PATIENCE
        expected = len(frames) - 2 * 500 - 2  # but for the seconds in which units are found out, and the last
        while picture.traffic["BASE_SAMPLE"].frames < expected and source.error is None:
            assert time.monotonic() < deadline, picture.traffic["BASE_SAMPLE"].frames
            picture.take(source.drain(), source.now)
            time.sleep(0.01)
    finally:
        source.stop()
    assert source.error is None
    picture.take(source.drain(), source.now)
    return picture


def test_frames_of_can_fd_on_a_bus(fd_database: Path, fd_frames: list[can.Message], tmp_path: Path) -> None:
    """One message of 24 bytes, as on the bus so in its log."""
    online = Online(read_mapping(FD_MAPPED), str(fd_database))
    assert online.fd
    with can.Bus(interface="virtual", channel="fd", preserve_timestamps=True, fd=True) as other_end:
        source = MappedBusSource("virtual", "fd", online, Config(), {"fd": True})
        picture = shown(source, fd_frames, other_end)
    (found,) = (entry for entry in picture.dynamics() if entry.key == "natural_frequency")
    assert found.value == pytest.approx(NATURAL_FREQUENCY, rel=0.03)
    log = tmp_path / "fd.log"
    with can.Logger(log) as logger:
        for frame in fd_frames:
            logger(frame)
    summary = replayed(tmp_path / "out", log, "--dbc", fd_database, "--map", *FD_MAPPED)
    assert summary["samples"] == SENT
    assert abs(found.value - frequency(summary)) < found.sigma


def test_a_message_of_eight_bytes_is_classic_can(folder: Path) -> None:
    assert not Online(read_mapping(MAPPED), str(folder / "foreign.dbc")).fd


# --- the page ---------------------------------------------------------------------------------------------------------


class Wire(VirtualBus):
    """A virtual bus under the name of another interface."""

    def __init__(self, channel: str, **_: Any) -> None:
        super().__init__(channel, preserve_timestamps=True)


@pytest.fixture
def port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number: int = free.getsockname()[1]
        return number


class Page:
    """A browser's end of `lever live`, in a thread of its own; ends that by Ctrl-C once the natural frequency is known
    to 5 %."""

    def __init__(self, port: int) -> None:
        self.first: dict[str, Any] = {}
        self.frequency: float | None = None
        self._port = port
        self._thread = threading.Thread(target=lambda: asyncio.run(self._look()))

    async def _look(self) -> None:
        deadline = time.monotonic() + PATIENCE
        while (connection := await self._connected()) is None:
            assert time.monotonic() < deadline
            await asyncio.sleep(0.05)
        while self.frequency is None and (text := await connection.read_message()) is not None:
            message = json.loads(text)
            self.first = message.get("start", self.first)
            keys = [quantity["key"] for quantity in self.first["quantities"]]
            first = 1 + 3 * keys.index("natural_frequency")
            value, sigma = message.get("update", {"row": [None] * 99})["row"][first : first + 2]
            if value is not None and sigma is not None and sigma < 0.025 * value:
                self.frequency = value
        connection.close()
        while await connection.read_message() is not None:
            pass
        os.kill(os.getpid(), signal.SIGINT)

    async def _connected(self) -> WebSocketClientConnection | None:
        try:
            return await websocket_connect(f"ws://127.0.0.1:{self._port}/socket")
        except OSError:
            return None

    def __enter__(self) -> Page:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(PATIENCE)


@pytest.fixture
def sender(frames: list[can.Message]) -> Iterator[None]:
    """Send the flight over and over."""
    ended = threading.Event()

    def send() -> None:
        with can.Bus(interface="virtual", channel="wire", preserve_timestamps=True) as other_end:
            for frame in frames:
                if ended.is_set():
                    return
                other_end.send(frame)
                time.sleep(50e-6)
            ended.wait()

    thread = threading.Thread(target=send)
    thread.start()
    yield
    ended.set()
    thread.join()


@pytest.mark.usefixtures("sender")
def test_the_page_of_a_mapped_bus(folder: Path, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BACKENDS, "kvaser", (__name__, Wire.__name__))
    bus = ("--interface", "kvaser", "--channel", "wire", "--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED)
    with Page(port) as page:
        assert main(["live", *bus, "--port", str(port)]) == INTERRUPTED
    assert page.first["title"] == "kvaser wire"
    assert not page.first["controls"]  # there is no estimator to be commanded
    assert page.frequency == pytest.approx(NATURAL_FREQUENCY, rel=0.05)


def test_the_page_of_a_mapped_log(folder: Path, port: int) -> None:
    with Page(port) as page:
        arguments = (str(folder / "flight.blf"), "--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED)
        assert main(["live", *arguments, "--port", str(port)]) == INTERRUPTED
    assert page.frequency == pytest.approx(NATURAL_FREQUENCY, rel=0.05)
