"""`cantools monitor` on a live bus, with the DBC as it is."""

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
from lever_cdkf.host_tools.can import codec
from lever_cdkf.host_tools.files import native_file
from vcan import rig

CANTOOLS = str(Path(sys.executable).with_name("cantools"))
SHOWN = b"theta: 0.3507 rad"


@contextlib.contextmanager
def monitor(interface: str) -> Iterator[int]:
    """`cantools monitor` in a terminal, of which this is the other end."""
    terminal, inside = pty.openpty()
    os.set_blocking(terminal, False)
    command = [CANTOOLS, "monitor", "-i", "socketcan", "-c", interface, str(native_file("lever.dbc"))]
    environment = os.environ | {"TERM": "xterm", "LINES": "40", "COLUMNS": "120"}
    monitoring = subprocess.Popen(command, stdin=inside, stdout=inside, stderr=inside, env=environment)
    try:
        yield terminal
    finally:
        monitoring.kill()
        monitoring.wait()
        os.close(inside)
        os.close(terminal)


def test_monitor_shows_a_signal_with_its_unit(interface: str) -> None:
    identifier, sample = codec.message("LEVER_SAMPLE").frame_id, codec.encoder("LEVER_SAMPLE")
    screen, count = bytearray(), 0

    def is_shown() -> bool:
        """After another sample."""
        nonlocal count
        data = sample(count, 0.3507, 0.0, 0.0)
        bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
        count += 1
        time.sleep(0.1)
        with contextlib.suppress(BlockingIOError):
            screen.extend(os.read(terminal, 1 << 20))
        return SHOWN in screen

    with can.Bus(interface="socketcan", channel=interface) as bus, monitor(interface) as terminal:
        rig.wait_until(is_shown, "the value on the screen")
