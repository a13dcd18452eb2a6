"""The tools of cantools on a live bus, with the DBC as it is."""

from __future__ import annotations

import contextlib
import os
import pty
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from lever_cdkf.host_tools.can import codec
from lever_cdkf.host_tools.files import native_file
from vcan import rig

CANTOOLS = str(Path(sys.executable).with_name("cantools"))
DBC = str(native_file("lever.dbc"))
SHOWN = "theta: 0.3507 rad"
LONGEST_S = 120.0
"""Two Python programs have to start, on one busy processor."""


@contextlib.contextmanager
def decode(interface: str, output: Path) -> Iterator[None]:
    """`candump -L | cantools decode`, into a file."""
    with output.open("wb") as file:
        candump = subprocess.Popen(["candump", "-L", interface], stdout=subprocess.PIPE)
        command = [CANTOOLS, "decode", "--single-line", DBC]
        decoding = subprocess.Popen(
            command, stdin=candump.stdout, stdout=file, env=os.environ | {"PYTHONUNBUFFERED": "1"}
        )
        assert candump.stdout is not None
        candump.stdout.close()  # it is the other's now
        try:
            yield
        finally:
            candump.kill()
            candump.wait()
            decoding.wait(LONGEST_S)


@contextlib.contextmanager
def monitor(interface: str) -> Iterator[int]:
    """`cantools monitor` in a terminal, of which this is the other end."""
    terminal, inside = pty.openpty()
    os.set_blocking(terminal, False)
    command = [CANTOOLS, "monitor", "-i", "socketcan", "-c", interface, DBC]
    environment = os.environ | {"TERM": "xterm", "LINES": "40", "COLUMNS": "120"}
    monitoring = subprocess.Popen(command, stdin=inside, stdout=inside, stderr=inside, env=environment)
    try:
        yield terminal
    finally:
        monitoring.kill()
        monitoring.wait()
        os.close(inside)
        os.close(terminal)


@pytest.mark.requires("candump")
def test_decode_and_monitor_show_signals_with_units(interface: str, tmp_path: Path) -> None:
    identifier, sample = codec.message("LEVER_SAMPLE").frame_id, codec.encoder("LEVER_SAMPLE")
    decoded, screen, count = tmp_path / "decoded", bytearray(), 0

    def is_shown() -> bool:
        """After twenty more samples, as candump hands on 4 KiB at once."""
        nonlocal count
        for _ in range(20):
            data = sample(count, 0.3507, 0.0, 0.0)
            bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
            count += 1
        with contextlib.suppress(BlockingIOError):
            screen.extend(os.read(terminal, 1 << 20))
        time.sleep(0.1)
        return SHOWN in decoded.read_text() and SHOWN.encode() in screen

    with (
        can.Bus(interface="socketcan", channel=interface) as bus,
        decode(interface, decoded),
        monitor(interface) as terminal,
    ):
        deadline = time.monotonic() + LONGEST_S
        while not is_shown():
            assert time.monotonic() < deadline, (decoded.read_text()[:500], bytes(screen[:2000]))
    assert rig.INTERFACE in decoded.read_text().splitlines()[0]
