"""Messages of CAN FD on a real interface: what a database calls so is received without being told."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import can
from vcan import rig

DATABASE = """VERSION ""
BU_: FCC

BO_ 512 Everything: 24 FCC
 SG_ Angle : 64|16@1- (0.005,0) [-90|90] "deg" FCC
 SG_ Acceleration : 160|16@1- (0.0002,0) [-6|6] "g" FCC
"""
LEVER = [sys.executable, "-m", "lever_cdkf.cli.main"]
FD_MTU = "72"


def test_frames_of_can_fd_are_recorded(tmp_path: Path) -> None:
    database, log = tmp_path / "fd.dbc", tmp_path / "fd.log"
    database.write_text(DATABASE)
    partial = log.with_name(f"{log.name}.partial")
    sent = [bytes([number]) * 24 for number in range(100)]
    with rig.new_interface() as interface:
        rig.ip("link", "set", interface, "down")
        rig.ip("link", "set", interface, "mtu", FD_MTU)
        rig.ip("link", "set", interface, "up")
        command = [*LEVER, "record", "--interface", "socketcan", "--channel", interface, "-o", str(log)]
        mapped = ["--dbc", str(database), "--map", "theta=Angle", "z_ddot=Acceleration"]
        with (
            subprocess.Popen([*command, *mapped], stderr=subprocess.PIPE, text=True) as recorder,
            can.Bus(interface="socketcan", channel=interface, fd=True) as bus,
        ):
            rig.wait_until(partial.exists, "it records")
            for data in sent:
                bus.send(can.Message(arbitration_id=0x200, is_extended_id=False, is_fd=True, data=data))
            rig.wait_until(lambda: partial.read_text().count("200##") == len(sent), "every frame is recorded")
            recorder.send_signal(signal.SIGINT)
            errors = recorder.communicate(timeout=rig.PATIENCE_S)[1]
    assert recorder.returncode == 0, errors
    with can.LogReader(log) as reader:
        assert [bytes(message.data) for message in reader if message.is_fd] == sent
