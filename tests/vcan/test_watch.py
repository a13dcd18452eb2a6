"""`lever monitor` beside a simulation on a virtual CAN interface: it sees what passes, and nobody notices."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from vcan import rig
from vcan.test_simulation import lever_sim, settings_file


def test_the_monitor_sees_the_run_and_changes_nothing(build_dir: Path, tmp_path: Path) -> None:
    lever = str(Path(sys.executable).with_name("lever"))
    over_can, in_process = tmp_path / "over_can", tmp_path / "in_process"
    options = ["--settings", settings_file("steady", tmp_path)]
    with (
        rig.new_interface() as interface,
        rig.LeverCan(build_dir / "lever_can", interface, options, tmp_path) as process,
    ):
        bus = ["--interface=socketcan", f"--channel={interface}"]
        monitor = subprocess.Popen(
            [lever, "monitor", *bus, "--once", "--duration=6"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        lever_sim("steady", *bus, "--realtime", f"--out={over_can}")
        shown, errors = monitor.communicate(timeout=60)
        totals = process.stop()
    assert (monitor.returncode, errors) == (0, "")
    assert re.search(r"^mode +run", shown, re.MULTILINE), shown
    row = re.search(r"^STATE_ESTIMATE +(\d+) ", shown, re.MULTILINE)
    assert row is not None, shown
    assert int(row[1]) > 200
    assert re.search(r"^k_p +\d+ +± \d+ N/m", shown, re.MULTILINE), shown
    lever_sim("steady", f"--out={in_process}")
    log = (over_can / "bus.log").read_text()
    assert log.replace(f" {rig.INTERFACE} ", " lever ") == (in_process / "bus.log").read_text()
    assert totals["frames in"] + totals["frames out"] == log.count("\n")
