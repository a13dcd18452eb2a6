"""`lever record`: what is on a bus is in the log, what is missing is counted, and a log that broke off says so."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest
from lever_cdkf.host_tools import cli
from lever_cdkf.host_tools.can.recorder import Recorder
from python.conftest import Session

CHANNEL = "recorded"


def messages(session: Session, first: int, last: int) -> list[can.Message]:
    with can.CanutilsLogReader(session.log) as reader:
        return list(reader)[first:last]


@pytest.fixture
def send() -> Iterator[Callable[[list[can.Message]], None]]:
    """send(messages): onto the virtual bus, a moment later, from another thread."""
    threads = []

    def later(frames: list[can.Message]) -> None:
        def run() -> None:
            with can.Bus(interface="virtual", channel=CHANNEL) as bus:
                time.sleep(0.5)
                for frame in frames:
                    bus.send(frame)

        threads.append(threading.Thread(target=run))
        threads[-1].start()

    yield later
    for thread in threads:
        thread.join()


@pytest.fixture(autouse=True)
def _heard_in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """python-can's virtual bus, whose other end is a thread of the test, stands for a real one."""
    monkeypatch.setattr("lever_cdkf.host_tools.can.buses._IN_PROCESS", ())


def record(path: Path, seconds: float = 1.5) -> int:
    arguments = ["--interface", "virtual", "--channel", CHANNEL, "-o", str(path), "--duration", str(seconds)]
    return cli.main(["record", *arguments])


def test_the_log_has_every_frame_and_can_be_replayed(
    session: Session, send: Callable[..., None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = messages(session, 0, 3000)
    send(sent)
    log = tmp_path / "a.log"
    assert record(log) == 0
    told = capsys.readouterr().out
    assert "3000 frames, 0 lost, 0 corrupt, 0 error frames" in told
    assert "LEVER_SAMPLE" in told
    with can.CanutilsLogReader(log) as reader:
        read = [(frame.arbitration_id, bytes(frame.data)) for frame in reader]
    assert read == [(frame.arbitration_id, bytes(frame.data)) for frame in sent]
    assert [path.name for path in tmp_path.iterdir()] == ["a.log"]
    assert cli.main(["replay", str(log)]) == 0
    assert "reproduced bit for bit" in capsys.readouterr().out


def test_losses_and_damage_are_counted(
    session: Session, send: Callable[..., None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames = messages(session, 0, 2000)
    lever = [index for index, frame in enumerate(frames) if frame.arbitration_id == 0x110]
    gone = {lever[50], lever[51], lever[100]}
    frames[lever[200]].data[3] ^= 1
    error = can.Message(is_error_frame=True)
    other = can.Message(arbitration_id=0x700, is_extended_id=False, data=b"\1")
    send([*(frame for index, frame in enumerate(frames) if index not in gone), error, other])
    assert record(tmp_path / "a.log") == 0
    told = capsys.readouterr().out
    assert "1999 frames, 3 lost, 1 corrupt, 1 error frames" in told
    row = next(line.split() for line in told.splitlines() if "LEVER_SAMPLE" in line)
    assert [row[index] for index in (4, 5, 6)] == ["3", "0", "1"]


def test_a_log_that_is_there_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.log", "a.log.partial"):
        (tmp_path / name).write_text("precious")
        assert record(tmp_path / "a.log", 0.2) == 2
        assert f"{name} exists already" in capsys.readouterr().err
        assert (tmp_path / name).read_text() == "precious"
        (tmp_path / name).unlink()


def test_a_full_disk_leaves_a_partial_log_and_one_line(session: Session, tmp_path: Path) -> None:
    program = (
        "import sys, threading, time, can\n"
        "from lever_cdkf.host_tools import cli\n"
        "from lever_cdkf.host_tools.can import buses\n"
        "buses._IN_PROCESS = ()\n"
        f"frames = list(can.LogReader({str(session.log)!r}))[:3000]\n"
        "def send():\n"
        f"    with can.Bus(interface='virtual', channel={CHANNEL!r}) as bus:\n"
        "        time.sleep(0.5)\n"
        "        for frame in frames: bus.send(frame)\n"
        "threading.Thread(target=send).start()\n"
        f"arguments = ['record', '--interface=virtual', '--channel={CHANNEL}', '-o', 'a.log', '--duration=60']\n"
        "sys.exit(cli.main(arguments))\n"
    )

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))

    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, preexec_fn=limit, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(
        "lever: error: cannot write a.log: File too large; what was recorded"
    )
    assert os.listdir(tmp_path) == ["a.log.partial"]
    assert (tmp_path / "a.log.partial").stat().st_size == 50_000


def test_ctrl_c_completes_the_log(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "from lever_cdkf.host_tools import cli\n"
        "from lever_cdkf.host_tools.can import buses\n"
        "buses._IN_PROCESS = ()\n"
        f"sys.exit(cli.main(['record', '--interface=virtual', '--channel={CHANNEL}', '-o', 'a.log']))\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        end = time.monotonic() + 30.0
        while not (tmp_path / "a.log.partial").exists():
            assert time.monotonic() < end
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=30.0)
    assert process.returncode == 0, errors
    assert "a.log: 0 frames, 0 lost" in output
    assert os.listdir(tmp_path) == ["a.log"]


@pytest.mark.parametrize("interface", ["lever", "virtual"])
def test_a_bus_on_which_nobody_else_is_is_refused(
    interface: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.undo()
    assert cli.main(["record", "--interface", interface, "--channel", "x", "-o", str(tmp_path / "a.log")]) == 2
    assert f"lever: error: interface {interface} stays inside one process, " in capsys.readouterr().err
    assert os.listdir(tmp_path) == []


def test_a_bus_that_is_not_there_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["record", "--interface", "socketcan", "--channel", "can77", "-o", str(tmp_path / "a.log")]
    assert cli.main(command) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert os.listdir(tmp_path) == []


def test_the_state_of_the_controller_is_read_from_error_frames(tmp_path: Path) -> None:
    """<linux/can/error.h>: byte 1 of class 4 has the controller's conditions; 0x40 is bus off, 0x100 restarted."""

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
        recorder.run(lambda: not bus.frames, lambda _: None)
    assert recorder.error_frames == 6
    assert recorder.overflows == 1
    assert recorder.left_active == 1
    assert recorder.bus_state == "active"
