"""`lever qemu`: the flash image is an SLCAN adapter as any, started and ended cleanly; what is wrong is told."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial
from lever_cdkf.board import qemu
from lever_cdkf.cli.main import main
from lever_cdkf.firmware.config import CHOICES
from vcan import rig

QEMU = pytest.mark.requires(qemu.PROGRAM)
RESET: dict[str, float | str | None] = {
    "request": "reset",
    **dict.fromkeys(CHOICES, "keep"),
    "dither_rms": 0.0,
}
LEVER = str(Path(sys.executable).with_name("lever"))


@pytest.fixture(scope="module")
def channel(slcan_image: Path) -> Iterator[str]:
    """Yield the channel of the image on the emulated board, for all tests of this file."""
    with qemu.running(slcan_image, count_instructions=True) as name:
        yield name


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


# --- the image as an adapter --------------------------------------------------------------------------------------


@QEMU
def test_it_answers_commands_and_refuses_what_is_malformed(channel: str) -> None:
    asked = [
        (b"V\r", rb"V\d{4}\r"),
        (b"N\r", rb"N\w{4}\r"),
        (b"C\r", rb"\a"),
        (b"t1100\r", rb"\a"),
        (b"S8\r\rO\rO\r", rb"\r\r\r\a"),
        (b"F\r", rb"F00\r"),
        (b"t11\r" + b"t" * 100 + b"\r" + b"\xff\xfe\r", rb"\a\a\a"),
        (b"T0000011080102030405060708\rr1108\r", rb"Z\rz\r"),
        (b"C\rL\rt1100\rC\r", rb"\r\r\a\r"),
    ]
    with serial.serial_for_url(channel, timeout=rig.PATIENCE_S) as line:
        for command, answer in asked:
            line.write(command)
            got = b""
            while not re.fullmatch(answer, got):  # what comes beyond it is in the next one's way
                more = line.read(1)
                assert more, f"{command!r}: {got!r}"
                got += more


# --- the command --------------------------------------------------------------------------------------------------


@QEMU
def test_a_command_gets_the_channel_and_its_status_is_passed_on(slcan_image: Path) -> None:
    connect = "import serial, sys; line = serial.serial_for_url(sys.argv[1], timeout=1)"
    ask = f"{connect}; line.write(b'V\\r'); print(line.read(6)); line.close(); sys.exit(7)"
    command = [LEVER, "qemu", str(slcan_image), "--", sys.executable, "-c", ask, "{channel}"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=rig.PATIENCE_S)
    assert (result.returncode, result.stderr) == (7, "")
    assert re.fullmatch(r"b'V\d{4}\\r'\n", result.stdout)


@QEMU
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 128 + signal.SIGTERM)])
def test_it_ends_with_its_board(slcan_image: Path, number: signal.Signals, status: int) -> None:
    process = subprocess.Popen([LEVER, "qemu", str(slcan_image)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    first = process.stdout.readline()
    assert re.fullmatch(r"lever_stm32f4_slcan.elf answers on socket://127\.0\.0\.1:\d+ .*\n", first)
    (board,) = children(process.pid)
    assert process.stdout.readline().startswith("  lever sim ")
    process.send_signal(number)
    assert process.wait(rig.PATIENCE_S) == status
    assert not Path(f"/proc/{board}").exists()
    process.stdout.close()


def says(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Return the one line with which the command refuses."""
    assert main(["qemu", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    return captured.err


def test_no_qemu(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    expected = "lever: error: qemu-system-arm is not installed: install it (Debian: apt install qemu-system-arm)\n"
    assert says(capsys, "some.elf") == expected


@QEMU
def test_no_image(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    missing = tmp_path / "missing.elf"
    expected = (
        f"lever: error: no image {missing}: build it with: cmake --preset stm32f4 && cmake --build --preset stm32f4\n"
    )
    assert says(capsys, str(missing)) == expected
    assert "cannot read" in says(capsys, str(tmp_path))


@QEMU
@pytest.mark.parametrize("content", [b"", b":020000040800F2\n", b"\x7fELF\x02\x01" + bytes(30)])
def test_not_an_image(capsys: pytest.CaptureFixture[str], tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "other.hex"
    file.write_bytes(content)
    assert "other.hex is not an ELF file for ARM: give the .elf of the build" in says(capsys, str(file))


@QEMU
def test_an_image_that_does_not_answer(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, can_image: Path
) -> None:
    monkeypatch.setattr(qemu, "_START_S", 1.0)
    assert "has not answered within 1 s on its first serial line: is it the image for SLCAN" in says(
        capsys, str(can_image)
    )


@QEMU
def test_a_command_that_does_not_say_where_the_channel_goes(
    capsys: pytest.CaptureFixture[str], slcan_image: Path
) -> None:
    assert "write {channel} in its place" in says(capsys, str(slcan_image), "--", "echo", "channel")
    assert "cannot run no_such_program" in says(capsys, str(slcan_image), "--", "no_such_program", "{channel}")
