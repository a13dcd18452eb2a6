"""lever_can as a process behind a pseudo-terminal or serial line: whatever its host does, it answers as it should.

The answers are compared, byte for byte, with those of the firmware in this process.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import can
import pytest
from lever_cdkf.can.protocol_ahead import read_ahead
from vcan import rig

SAMPLES = 250

Start = Callable[..., rig.LeverCan]


@pytest.fixture
def link(tmp_path: Path) -> Path:
    """Where lever_can makes its link."""
    return tmp_path / "lever0"


@pytest.fixture
def start(build_dir: Path, tmp_path: Path) -> Iterator[Start]:
    """start(medium, name, *options): lever_can, ended after the test."""
    with ExitStack() as stack:
        yield lambda medium, name, *options, supervised=False: stack.enter_context(
            rig.LeverCan(build_dir / "lever_can", str(name), options, tmp_path, medium, supervised=supervised)
        )


def host(channel: Path) -> rig.Host:
    """python-can's slcan, as `lever sim` opens it."""
    named = read_ahead(str(channel))
    return rig.Host(can.Bus(interface="slcan", channel=named, sleep_after_open=0.0, bitrate=1_000_000))


class Line:
    """A pseudo-terminal whose one end a test holds; `path` is the other."""

    def __init__(self, path: Path) -> None:
        self.end, other = os.openpty()
        tty.setraw(other)
        self._other = other
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(other))
        os.set_blocking(self.end, False)

    def read_until(self, text: bytes) -> bytes:
        """Return what comes, up to and including `text`."""
        got = b""
        while text not in got:
            assert select.select([self.end], [], [], rig.PATIENCE_S)[0], f"{text!r} does not come after {got!r}"
            got += os.read(self.end, 1)
        return got

    def write(self, data: bytes) -> None:
        os.write(self.end, data)

    def unplug(self) -> None:
        os.close(self._other)
        os.close(self.end)


# --- as an adapter, behind a pseudo-terminal ----------------------------------------------------------------------


@pytest.mark.requirement("R49")
def test_its_answers_are_those_of_the_firmware_in_this_process(start: Start, link: Path) -> None:
    process = start("pty", link)
    there = host(link)
    began = time.perf_counter()
    answers = there.run(4 * SAMPLES)
    print(f"{4 * SAMPLES / (time.perf_counter() - began):.0f} lock-step round trips a second")
    assert answers == rig.in_process(4 * SAMPLES)
    there.bus.shutdown()
    process.wait_for("hung up")
    totals = process.stop()
    assert (totals["samples"], totals["frames in"], totals["frames out"]) == (4 * SAMPLES, 8 * SAMPLES, len(answers))
    assert (totals["dropped"], totals["lines refused"], totals["lost"], totals["unsent"]) == (
        0,
        2,
        0,
        0,
    )  # C, and O twice
    assert not link.is_symlink()


def test_hosts_come_and_go_and_the_estimate_stays(start: Start, link: Path) -> None:
    process = start("pty", link)
    answers, sent = [], 0
    for visit in range(1, 4):
        there = host(link)
        there.samples_sent = sent
        answers += there.run(SAMPLES)
        sent = there.samples_sent
        there.bus.shutdown()
        process.wait_for("link lost (the host has hung up); waiting for it with the estimate kept", visit)
    assert answers == rig.in_process(3 * SAMPLES)
    assert process.stop()["outages"] == 3


def test_a_host_that_was_killed_leaves_nothing_behind(start: Start, link: Path) -> None:
    process = start("pty", link)
    with open(link, "r+b", buffering=0) as line:
        tty.setraw(line.fileno())
        line.write(b"O\rt1108")
        assert select.select([line], [], [], rig.PATIENCE_S)[0]
    process.wait_for("hung up")
    there = host(link)
    assert there.run(20) == rig.in_process(20)
    there.bus.shutdown()
    process.stop()


@pytest.mark.requirement("R50")
def test_a_host_that_never_reads_is_not_waited_for(start: Start, link: Path) -> None:
    process = start("pty", link)
    flood = b"O\r" + b"".join(as_line(frame) for sample in rig.samples(0, 4000) for frame in sample)
    before = bytes_read(process)
    with open(link, "r+b", buffering=0) as line:
        tty.setraw(line.fileno())
        for first in range(0, len(flood), 1000):
            line.write(flood[first : first + 1000])
        rig.wait_until(lambda: bytes_read(process) == before + len(flood) and is_waiting(process), "all is taken")
        totals = process.stop()
    assert totals["samples"] == 4000
    assert totals["dropped"] > 0
    assert totals["lost"] == totals["unsent"] == totals["held"] == 0


def bytes_read(process: rig.LeverCan) -> int:
    """By the process, since it started."""
    return int(Path(f"/proc/{process.process.pid}/io").read_text().split()[1])


def is_waiting(process: rig.LeverCan) -> bool:
    """Return whether it has nothing to do."""
    return Path(f"/proc/{process.process.pid}/stat").read_text().rpartition(") ")[2].startswith("S")


def test_noise_is_answered_and_does_not_disturb(start: Start, link: Path) -> None:
    process = start("pty", link)
    there = host(link)
    answers = there.run(20)
    with open(link, "r+b", buffering=0) as line:
        for noise in (
            bytes(range(1, 7)) * 50 + b"\r",
            b"t" * 500 + b"\r",
            b"t110\xff\r",
            b"\x07\x07",
            b"T0000011080102030405060708\r",
        ):
            line.write(noise)
            answers += there.run(20)
    assert answers == rig.in_process(120)
    there.bus.shutdown()
    assert process.stop()["lines refused"] == 2 + 5


def test_a_link_that_was_left_behind_is_replaced_and_a_file_is_not(start: Start, link: Path, build_dir: Path) -> None:
    link.symlink_to("/dev/pts/no-such-terminal")
    start("pty", link).stop()
    link.write_text("precious")
    command = [str(build_dir / "lever_can"), "--pty", str(link)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=rig.PATIENCE_S)
    assert result.returncode == 1
    assert result.stderr == f"lever_can: {link}: cannot make the link to the pseudo-terminal: File exists\n"
    assert link.read_text() == "precious"


def test_it_starts_again_after_it_was_killed(start: Start, link: Path) -> None:
    """The number of its pseudo-terminal is free then, and given to the next one that is opened: ours, or another."""
    for taken in (False, False, True):
        process = start("pty", link)
        process.process.kill()
        process.process.wait()
        time.sleep(0.05)  # file systems tell times that are this far apart
        other = os.openpty() if taken else ()
        again = start("pty", link)
        there = host(link)
        assert there.run(20) == rig.in_process(20)
        there.bus.shutdown()
        for file in other:
            os.close(file)
        again.process.kill()
        again.process.wait()


def test_a_link_that_is_in_use_is_not_taken_away(start: Start, link: Path, build_dir: Path) -> None:
    process = start("pty", link)
    process.process.send_signal(signal.SIGSTOP)
    command = [str(build_dir / "lever_can"), "--pty", str(link)]
    assert subprocess.run(command, capture_output=True, timeout=rig.PATIENCE_S).returncode == 1
    process.process.send_signal(signal.SIGCONT)
    there = host(link)
    assert there.run(20) == rig.in_process(20)
    there.bus.shutdown()
    process.stop()


# --- torque, by the clock -----------------------------------------------------------------------------------------


def test_torque_ends_when_samples_do(start: Start, link: Path) -> None:
    process = start("pty", link, supervised=True)
    there = host(link)
    there.run_with_torque()
    rig.wait_until(lambda: rig.torques(there.rest())[-1:] == [0.0], "no torque is asked for")
    there.bus.shutdown()
    assert process.stop()["unsent"] == 0


def test_samples_from_before_a_stop_move_no_motor(start: Start, link: Path) -> None:
    process = start("pty", link, supervised=True)
    there = host(link)
    there.run_with_torque()
    process.process.send_signal(signal.SIGSTOP)
    for sample in rig.samples(there.samples_sent, 20):
        for frame in sample:
            there.send(frame)
    time.sleep(0.1)
    process.process.send_signal(signal.SIGCONT)
    answers = [frame for _ in range(20) for frame in there.answer()]
    assert not any(rig.torques(answers))
    there.bus.shutdown()
    process.stop()


# --- on a serial device -------------------------------------------------------------------------------------------


def test_it_is_an_adapter_on_a_serial_device_too(start: Start, link: Path) -> None:
    line = Line(link)
    process = start("serial", f"{link}:921600")
    line.write(b"V\rO\r")
    assert line.read_until(b"\r").startswith(b"V")
    assert line.read_until(b"\r") == b"\r"
    answers = []
    for lever, base in rig.samples(0, 20):
        line.write(as_line(lever) + as_line(base))
        answers += as_frames(line.read_until(b"t210") + line.read_until(b"\r"))
    assert answers == rig.in_process(20)
    process.stop()
    line.unplug()


def as_line(frame: rig.Frame) -> bytes:
    return f"t{frame[0]:03X}8{frame[1].hex().upper()}\r".encode()


def as_frames(text: bytes) -> list[rig.Frame]:
    lines = [line for line in text.decode().split("\r") if line.startswith("t")]
    return [(int(line[1:4], 16), bytes.fromhex(line[5:])) for line in lines]


def test_it_opens_an_adapters_channel_feeds_on_it_and_closes_it(start: Start, link: Path) -> None:
    line = Line(link)
    process = start("slcan", link)
    assert line.read_until(b"O\r") == b"\r\rC\rS8\rO\r"
    line.write(b"\r\r\a\r\r")
    answers = []
    for count, (lever, base) in enumerate(rig.samples(0, SAMPLES)):
        line.write(as_line(lever)[:-1] + b"1A2B\r" + b"t7FF0\rT000001100\rr1100\r" + as_line(base))
        answers += as_frames(line.read_until(b"t210") + line.read_until(b"\r"))
        line.write(b"\a" if count in (20, 30) else b"z\r")
    assert answers == rig.in_process(SAMPLES)
    totals = process.stop()
    assert line.read_until(b"C\r") == b"C\r"
    assert totals["refused by the adapter"] == 2
    line.unplug()


def test_it_waits_for_an_adapter_that_is_unplugged(start: Start, link: Path) -> None:
    line = Line(link)
    process = start("slcan", link)
    line.read_until(b"O\r")
    line.write(b"".join(map(as_line, next(rig.samples(0, 1)))))
    line.read_until(b"t210")
    line.unplug()
    process.wait_for("link lost (the device is gone)")
    line = Line(link)
    assert line.read_until(b"O\r") == b"\r\rC\rS8\rO\r"
    line.write(b"".join(map(as_line, next(rig.samples(1, 1)))))
    line.read_until(b"t210")
    process.wait_for("link restored")
    assert process.stop()["samples"] == 2
    with suppress(OSError):
        line.unplug()


@pytest.mark.parametrize(
    ("device", "reason"),
    [
        ("/dev/no_such_port", "No such file or directory"),
        ("/dev/null", "not a serial device"),
        ("/dev/null:1234", '"1234" is not a usual baud rate, such as 115200, 921600 or 1000000'),
        ("/dev/null:", '"" is not a usual baud rate, such as 115200, 921600 or 1000000'),
        (":9600", "the path of a device has 1 to 511 characters"),
    ],
)
@pytest.mark.parametrize("medium", ["slcan", "serial"])
def test_a_device_that_cannot_be_used(build_dir: Path, medium: str, device: str, reason: str) -> None:
    command = [str(build_dir / "lever_can"), f"--{medium}", device]
    result = subprocess.run(command, capture_output=True, text=True, timeout=rig.PATIENCE_S)
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == f"lever_can: {device}: {reason}\n"
