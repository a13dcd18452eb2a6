"""`lever monitor` beside a simulation on a virtual CAN interface: it sees what passes, and nobody notices."""

from __future__ import annotations

import contextlib
import io
import re
import threading
from pathlib import Path

from lever_cdkf.watch.once import print_once
from lever_cdkf.watch.picture import Frame
from lever_cdkf.watch.sources import BusSource
from vcan import rig
from vcan.test_simulation import in_process, lever_sim, settings_file


class Run(BusSource):
    """The bus, which ends when as many frames have come as were on it."""

    expected: int | None = None
    came = 0

    def drain(self) -> list[Frame]:
        frames = super().drain()
        self.came += len(frames)
        self.ended = self.came == self.expected
        return frames


def test_the_monitor_sees_the_run_and_changes_nothing(build_dir: Path, tmp_path: Path) -> None:
    over_can = tmp_path / "over_can"
    options = ["--settings", settings_file("steady", tmp_path)]
    expected = in_process("steady")
    screen = io.StringIO()
    with (
        rig.new_interface() as interface,
        rig.LeverCan(build_dir / "lever_can", interface, options, tmp_path) as process,
        contextlib.redirect_stdout(screen),
    ):
        watched = Run("socketcan", interface)
        watched.expected = expected.count("\n")
        monitor = threading.Thread(target=print_once, args=(watched, rig.PATIENCE_S))
        monitor.start()
        said = lever_sim("steady", "--interface=socketcan", f"--channel={interface}", f"--out={over_can}")
        monitor.join()
        totals = process.stop()
    shown = screen.getvalue() + said  # both print here, whichever is first
    assert re.search(r"^mode +run", shown, re.MULTILINE), shown
    assert re.search(r"^STATE_ESTIMATE +\S+ +0 +0 +0$", shown, re.MULTILINE), shown
    assert re.search(r"^k_p +\d+ +± \d+ N/m", shown, re.MULTILINE), shown
    assert (over_can / "bus.log").read_text() == expected
    assert totals["frames in"] + totals["frames out"] == watched.came == watched.expected
