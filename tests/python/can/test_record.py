"""`lever record`: what is on a bus is in the log, what is missing is counted, and a log that broke off says so."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter, deque
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import can
import numpy as np
import pytest
from can.interfaces import BACKENDS
from lever_cdkf.can import recorder
from lever_cdkf.can.recorder import Recorder
from lever_cdkf.cli.main import main
from lever_cdkf.runtime.provenance import sha256
from processes import PATIENCE, full_disk
from python.conftest import Refused, Session


class Line(can.BusABC):
    """A bus on which `frames` come, and then `end`."""

    channel_info = "a bus in a test"
    frames: ClassVar[deque[can.Message]] = deque()
    end: ClassVar[Callable[[], None]]

    def __init__(self, channel: str) -> None:
        super().__init__(channel)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.frames:
            return self.frames.popleft()
        type(self).end()
        return None

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError


@pytest.fixture(autouse=True)
def _line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Line is the bus of an interface that no test has a use for."""
    monkeypatch.setitem(BACKENDS, "kvaser", (__name__, Line.__name__))


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)


def failure() -> None:
    raise can.CanOperationError("Network is down")


def record(path: Path, frames: list[can.Message], end: Callable[[], None] = ctrl_c) -> int:
    Line.frames, Line.end = deque(frames), staticmethod(end)
    return main(["record", "--interface", "kvaser", "--channel", "x", "-o", str(path)])


def messages(session: Session, count: int) -> list[can.Message]:
    """Return the first ones of the log."""
    with can.CanutilsLogReader(session.log) as reader:
        return list(itertools.islice(reader, count))


def test_the_log_has_every_frame_and_can_be_replayed(
    session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = messages(session, 3000)
    log = tmp_path / "a.log"
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    assert record(log, sent) == 0
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
    printed = capsys.readouterr().out
    assert "3000 frames, 0 lost, 0 corrupt, 0 error frames" in printed
    assert "LEVER_SAMPLE" in printed
    with can.CanutilsLogReader(log) as reader:
        read = [(frame.arbitration_id, bytes(frame.data)) for frame in reader]
    assert read == [(frame.arbitration_id, bytes(frame.data)) for frame in sent]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.log", "a.log.provenance.json"]
    origin = json.loads((tmp_path / "a.log.provenance.json").read_text())
    assert origin["outputs"] == {"a.log": sha256(log)}
    assert main(["replay", str(log)]) == 0
    assert "reproduced bit for bit" in capsys.readouterr().out


def test_losses_and_damage_are_counted(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frames = messages(session, 2000)
    lever = [index for index, frame in enumerate(frames) if frame.arbitration_id == 0x110]
    gone = {lever[50], lever[51], lever[100]}
    frames[lever[200]].data[3] ^= 1
    error = can.Message(is_error_frame=True)
    other = can.Message(arbitration_id=0x700, is_extended_id=False, data=b"\1")
    sent = [*(frame for index, frame in enumerate(frames) if index not in gone), error, other]
    assert record(tmp_path / "a.log", sent) == 0
    printed = capsys.readouterr().out
    assert "1999 frames, 3 lost, 1 corrupt, 1 error frames" in printed
    row = next(line.split() for line in printed.splitlines() if "LEVER_SAMPLE" in line)
    assert [row[index] for index in (4, 5, 6)] == ["3", "0", "1"]


def test_each_row_of_a_recording(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sent = messages(session, 1000)
    other = can.Message(arbitration_id=0x700, is_extended_id=False, data=b"\1")
    Line.frames, Line.end = deque([*sent, other, other]), staticmethod(ctrl_c)
    file = tmp_path / "rows.json"
    command = ["record", "--interface", "kvaser", "--channel", "x", "-o", str(tmp_path / "a.log"), "--json", str(file)]
    assert main(command) == 0
    said = capsys.readouterr()
    assert said.err == f"recording a bus in a test into {tmp_path / 'a.log'}; Ctrl-C ends\n"
    summary = "1002 frames, 0 lost, 0 corrupt, 0 error frames, controller active"
    assert said.out.endswith(f"{tmp_path / 'a.log'}: {summary}\n")
    rows = {row["message"]: row for row in json.loads(file.read_text())["recorded"]}
    counts = Counter(message.arbitration_id for message in sent)
    assert {row["id"]: row["frames"] for name, row in rows.items() if name != "others"} == {
        f"{identifier:#05x}": count for identifier, count in counts.items()
    }
    assert list(rows)[-1] == "others"
    for name, row in rows.items():
        expected = None if name == "others" else 0
        assert [row[key] for key in ("lost", "repeated", "corrupt")] == [expected] * 3
    rates = [row["rate [1/s]"] / row["frames"] for row in rows.values()]
    assert rates == pytest.approx([rates[0]] * len(rates), rel=0.2)  # over the same time
    assert rows["others"]["frames"] == 2


def test_a_log_that_is_there_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.log", "a.log.partial"):
        (tmp_path / name).write_text("precious")
        assert record(tmp_path / "a.log", []) == 2
        assert f"{name} exists already" in capsys.readouterr().err
        assert (tmp_path / name).read_text() == "precious"
        (tmp_path / name).unlink()


def test_a_full_disk_leaves_a_partial_log_and_one_line(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with full_disk(50_000):
        assert record(Path("a.log"), messages(session, 3000)) == 2
    assert (
        capsys.readouterr()
        .err.splitlines()[-1]
        .startswith("lever: error: cannot write a.log: File too large; what was recorded")
    )
    assert os.listdir(tmp_path) == ["a.log.partial"]
    assert (tmp_path / "a.log.partial").stat().st_size == 50_000


def test_a_bus_that_fails_leaves_a_partial_log_and_one_line(
    session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert record(tmp_path / "a.log", messages(session, 100), failure) == 2
    line = "lever: error: the bus failed: Network is down; what was recorded until then, up to 100 frames, is in "
    assert capsys.readouterr().err.splitlines()[-1] == f"{line}{tmp_path}/a.log.partial"
    assert len((tmp_path / "a.log.partial").read_text().splitlines()) == 100


@pytest.mark.parametrize("terminal", [True, False])
def test_it_shows_how_it_goes(
    terminal: bool,
    session: Session,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    monkeypatch.setattr("lever_cdkf.can.recorder._TELL", 0.0)
    monkeypatch.setattr("lever_cdkf.commands.record._Line._BETWEEN_LINES", 0.0)
    assert record(tmp_path / "a.log", messages(session, 100)) == 0
    shown = capsys.readouterr().err.partition("Ctrl-C ends\n")[2]
    line = r"\d+ s, \d+ frames/s, 100 frames, 0 lost, 0 corrupt, 0 error frames, controller active"
    assert re.fullmatch(rf"(\r\x1b\[K{line})+\r\x1b\[K" if terminal else rf"(lever: record: {line}\n)+", shown)


def test_on_a_quiet_bus_it_asks_ten_times_a_second_whether_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that goes on only while the bus is waited for."""
    now = 0.0
    asked: list[float] = []
    told: list[float] = []

    def wait(_bus: can.BusABC, timeout: float) -> None:
        nonlocal now
        now += timeout

    def ended() -> bool:
        asked.append(now)
        return now > 9.95

    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: now))
    monkeypatch.setattr(Line, "recv", wait)

    with Line("x") as bus:
        Recorder(bus, tmp_path / "a.log", "x").run(ended, lambda it: told.append(it.elapsed))
    assert asked == pytest.approx(np.arange(101) / 10.0, abs=1e-6)
    assert len(told) in (9, 10)
    assert np.diff(told) == pytest.approx(1.0, abs=0.11)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [((), "no bus given: name one, such as "), (("--interface", "kvaser", "--duration", "0"), "--duration")],
)
def test_bad_input_is_one_line(arguments: tuple[str, ...], text: str, tmp_path: Path, refused: Refused) -> None:
    assert text in refused("record", "-o", tmp_path / "a.log", *arguments)


def test_ctrl_c_completes_the_log(tmp_path: Path) -> None:
    """In a process, on python-can's virtual bus."""
    program = (
        "import sys\n"
        "from lever_cdkf.cli.main import main\n"
        "from lever_cdkf.can import buses\n"
        "buses._IN_PROCESS = ()\n"
        "sys.exit(main(['record', '--interface=virtual', '--channel=x', '-o', 'a.log']))\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        end = time.monotonic() + PATIENCE
        while not (tmp_path / "a.log.partial").exists():
            assert time.monotonic() < end
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    assert "a.log: 0 frames, 0 lost" in output
    assert sorted(os.listdir(tmp_path)) == ["a.log", "a.log.provenance.json"]


@pytest.mark.parametrize("interface", ["lever", "virtual"])
def test_a_bus_on_which_nobody_else_is_is_refused(interface: str, tmp_path: Path, refused: Refused) -> None:
    line = refused("record", "--interface", interface, "--channel", "x", "-o", tmp_path / "a.log")
    assert f"interface {interface} stays inside one process, " in line
    assert os.listdir(tmp_path) == []


def test_the_state_of_the_controller_is_read_from_error_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """<linux/can/error.h>: byte 1 of class 4 has the controller's conditions; 0x40 is bus off, 0x100 restarted."""

    count, states = Recorder._count, list[str]()

    def count_and_note(recorder: Recorder, frame: can.Message) -> None:
        count(recorder, frame)
        states.append(recorder.bus_state)

    class SocketcanBus(can.BusABC):
        channel_info = "a bus in a test"

        def __init__(self) -> None:
            super().__init__("test")
            self.frames = [(0x04, 0x01), (0x04, 0x08), (0x04, 0x20), (0x40, 0), (0x100, 0), (0x08, 0x20)]

        def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
            if not self.frames:
                return None, True
            identifier, conditions = self.frames.pop(0)
            data = bytes([0, conditions, 0, 0, 0, 0, 0, 0])
            return can.Message(arbitration_id=identifier, is_error_frame=True, data=data), True

        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            raise NotImplementedError

    with SocketcanBus() as bus:
        recorder = Recorder(bus, tmp_path / "a.log", "can0")
        monkeypatch.setattr(Recorder, "_count", count_and_note)
        recorder.run(lambda: not bus.frames, lambda _: None)
    assert states == ["active", "warning", "passive", "bus off", "active", "active"]
    assert recorder.error_frames == 6
    assert recorder.overflows == 1
    assert recorder.left_active == 1
    assert recorder.bus_state == "active"
