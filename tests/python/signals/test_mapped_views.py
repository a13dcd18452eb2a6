"""Views of what has no estimator: the firmware in this process estimates from mapped signals."""

from __future__ import annotations

import json
import re
import signal
import time
from collections import deque
from pathlib import Path
from typing import ClassVar

import can
import pytest
from can.interfaces import BACKENDS
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import Config
from lever_cdkf.signals.mapping import read_mapping
from lever_cdkf.signals.online import Online
from lever_cdkf.watch.mapped import MappedBusSource
from lever_cdkf.watch.picture import Picture
from python.conftest import Refused
from python.signals.flight import MAPPED, NATURAL_FREQUENCY
from python.signals.test_mapped_replay import frequency, replayed


class Line(can.BusABC):
    """A bus on which `frames` come, and then Ctrl-C."""

    channel_info = "a bus in a test"
    frames: ClassVar[deque[can.Message]] = deque()

    def __init__(self, channel: str) -> None:
        super().__init__(channel)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.frames:
            return self.frames.popleft()
        signal.raise_signal(signal.SIGINT)
        return None

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError


def shown_frequency(text: str) -> float:
    match = re.search(r"natural frequency\s+([\d.]+)", text.replace("_", " "))
    assert match is not None, text
    return float(match[1])


def test_a_log_at_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED]
    assert main(["monitor", "--once", str(folder / "flight.log"), *arguments]) == 0
    said = capsys.readouterr()
    assert shown_frequency(said.out) == pytest.approx(NATURAL_FREQUENCY, rel=0.02)
    assert said.err == (
        "lever: warning: z_ddot = AhrsAccel.AccVert: gravity is in it, and is subtracted (gravity=included).\n"
    )


def test_the_margin_of_an_aircraft(folder: Path, capsys: pytest.CaptureFixture[str], refused: Refused) -> None:
    watched = ["monitor", "--once", str(folder / "flight.log"), "--aircraft", "uh60_like,gearing=0.5"]
    assert main([*watched, "--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED]) == 0
    assert re.search(r"bounce +clear: gain margin \d+\.\d ± \d\.\d dB", capsys.readouterr().out)
    assert "--aircraft goes with --map" in refused(*watched)


def test_a_bus_gives_what_a_replay_of_its_log_gives(folder: Path, frames: list[can.Message], tmp_path: Path) -> None:
    """All but the first two of eight seconds, in which units and rates are found out."""
    database = str(folder / "foreign.dbc")
    online = Online(read_mapping(MAPPED), database)
    assert online.notes == []  # a page may ask before the first frame
    sent = [
        (frame.timestamp, estimate)
        for frame in frames[: len(frames) * 2 // 5]
        for estimate in online.take(frame.arbitration_id, frame.is_extended_id, bytes(frame.data), frame.timestamp)
    ]
    assert online.period == 2e-3
    assert any("gravity" in note for note in online.notes)
    lines = [f"({at:.6f}) can0 {identifier:03X}#{data.hex().upper()}\n" for at, (identifier, data) in sent]
    (tmp_path / "online.log").write_text("".join(lines))
    live = replayed(tmp_path / "live", tmp_path / "online.log", "--set", "sample_period=0.002")
    later = replayed(tmp_path / "log", folder / "part.log", "--dbc", database, "--map", *MAPPED, "--start", "2")
    assert live["samples"] == pytest.approx(later["samples"], abs=3)
    assert (live["lost"], live["corrupt"]) == (0, 0)
    assert frequency(live) == pytest.approx(frequency(later), rel=2e-3)


def test_a_view_of_a_bus(folder: Path, frames: list[can.Message]) -> None:
    online = Online(read_mapping(MAPPED), str(folder / "foreign.dbc"))
    with can.Bus(interface="virtual", channel="foreign", preserve_timestamps=True) as other_end:
        source = MappedBusSource("virtual", "foreign", online, Config())
        picture = Picture()
        source.start()
        try:
            for frame in frames[: len(frames) // 4]:
                other_end.send(frame)
            deadline = time.monotonic() + 30.0
            while picture.traffic["PILOT_DYNAMICS"].frames < 100 and source.error is None:
                assert time.monotonic() < deadline
                picture.take(source.drain(), source.now)
                time.sleep(0.01)
        finally:
            source.stop()
    assert source.error is None
    assert source.warning == f"{'; '.join(online.notes)}."  # what was guessed, for whoever has watched
    assert "gravity is in it" in source.warning


def test_a_recording_says_what_has_come_of_the_mapped_signals(
    folder: Path, frames: list[can.Message], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(BACKENDS, "kvaser", (__name__, Line.__name__))
    recording = ["record", "--interface", "kvaser", "--channel", "x", "--json", str(tmp_path / "rows.json")]
    mapped = ["--dbc", str(folder / "foreign.dbc"), "--map", *MAPPED]
    Line.frames = deque(frames[:16000])
    assert main([*recording, "-o", str(tmp_path / "flight.log"), *mapped]) == 0
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [(row["input"], row["rate_hz"], row["missing"]) for row in rows["signals"]] == [
        ("theta", 500.0, 0),
        ("theta_dot", 500.0, 0),
        ("z_ddot", 500.0, 0),
    ]
    assert {row["message"]: row["frames"] for row in rows["mapped messages"]} == {
        "InceptorPosition": 5000,
        "AhrsAccel": 5000,
    }
    Line.frames = deque(frames[2:3])  # of another message: the log is complete all the same
    assert main([*recording, "-o", str(tmp_path / "other.log"), *mapped]) == 0


def test_what_a_bus_needs(capsys: pytest.CaptureFixture[str], refused: Refused, folder: Path) -> None:
    bus = ("monitor", "--once", "--interface", "virtual", "--channel", "x")
    assert "both --dbc FILE and --map" in refused(*bus, "--map", *MAPPED)
    assert "no signal" in refused(*bus, "--dbc", folder / "foreign.dbc", "--map", "theta=Nothing", "z_ddot=AccVert")
