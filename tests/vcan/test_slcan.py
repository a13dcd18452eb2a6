"""lever_can and SLCAN programs that know nothing of it: Linux's slcan driver as its host, slcanpty as its adapter."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from lever_cdkf.can.bus import LeverBus
from vcan import rig

SAMPLES = 150
ATTACHED = "slcan9"


@contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[str]]:
    """Run a program until the end of the context."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=rig.PATIENCE_S)


def has_interface() -> bool:
    return subprocess.run(["ip", "link", "set", ATTACHED, "up"], capture_output=True, check=False).returncode == 0


@pytest.mark.requires("slcand")
def test_linux_as_its_host(build_dir: Path, tmp_path: Path) -> None:
    """The driver makes a CAN interface of the serial line."""
    link = tmp_path / "lever0"
    with rig.LeverCan(build_dir / "lever_can", str(link), [], tmp_path, "pty") as process:
        terminal = str(link.readlink().relative_to("/dev"))  # slcand puts /dev/ before what it is given
        with running("slcand", "-F", "-o", "-c", "-s8", terminal, ATTACHED) as attached:
            rig.wait_until(lambda: has_interface() or attached.poll() is not None, "the interface is there")
            if attached.poll() is not None:
                pytest.skip(f"no slcan driver in this kernel: {attached.communicate()[0]}")
            host = rig.Host.on(ATTACHED)
            assert host.run(SAMPLES) == rig.in_process(SAMPLES)
            host.bus.shutdown()
        process.wait_for("hung up")
        totals = process.stop()
    assert (totals["samples"], totals["dropped"], totals["unsent"]) == (SAMPLES, 0, 0)


@pytest.mark.requires("slcanpty", "stdbuf")
def test_slcanpty_as_its_adapter(build_dir: Path, tmp_path: Path, interface: str) -> None:
    """That program gives a CAN interface as an SLCAN adapter on a pseudo-terminal."""
    with running("stdbuf", "-o0", "slcanpty", "/dev/ptmx", interface) as adapter:
        assert adapter.stdout is not None
        said = adapter.stdout.readline()
        match = re.search(r"/dev/pts/\d+", said)
        assert match is not None, said
        with rig.LeverCan(build_dir / "lever_can", match[0], [], tmp_path, "slcan") as process:
            host = rig.Host.on(interface)
            first = host.reach()
            before = host.samples_sent - first
            answers = host.run(SAMPLES)
            totals = process.stop()
            host.bus.shutdown()
    with LeverBus(settings=rig.SETTINGS) as bus:
        same = rig.Host(bus)
        same.samples_sent = first
        same.run(before)
        assert answers == same.run(SAMPLES)
    assert totals["samples"] == SAMPLES + before
    assert (totals["refused by the adapter"], totals["unsent"], totals["lost"]) == (0, 0, 0)
