"""A log on a real CAN interface: canplayer feeds it to the process, candump records, `lever replay` gives the same."""

from __future__ import annotations

import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
from processes import LEVER, lever
from vcan import rig

SCENARIO = ("steady", "--set=duration=0.6 s", "--set=converged_after=0.4 s", "--set=limits={}")
INPUTS = ("110", "111", "120")
"""Identifiers of what the estimator takes."""


@dataclass(frozen=True)
class Log:
    """What was sent to the estimator in a simulation, as a log; and the settings it had."""

    path: Path
    settings: Path

    @property
    def samples(self) -> int:
        return sum(frame.startswith("111#") for frame in rig.frames(self.path))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    folder = tmp_path_factory.mktemp("log")
    recording = Log(folder / "inputs.log", folder / "settings")
    recording.settings.write_text(lever("sim", *SCENARIO, "--settings"))
    lever("sim", *SCENARIO, "--out", folder / "sim")
    lines = (folder / "sim/bus.log").read_text().splitlines(keepends=True)
    recording.path.write_text("".join(line for line in lines if line.split()[2][:3] in INPUTS))
    return recording


def play(log: Log, interface: str) -> None:
    """Send the log at its own pace."""
    subprocess.run(["canplayer", "-I", str(log.path), f"{interface}=lever"], check=True)


def answers(log: Path) -> list[str]:
    return [frame for frame in rig.frames(log) if frame.startswith("2") and frame[3] == "#"]


@pytest.mark.requires("canplayer", "candump", "cansend")
def test_the_process_answers_a_played_log_as_the_replay_does(
    log: Log, start: rig.Starter, interface: str, tmp_path: Path
) -> None:
    process, recorded = start("--settings", str(log.settings)), tmp_path / "candump.log"
    with rig.candump(interface, recorded):
        play(log, interface)
        rig.wait_until(lambda: recorded.read_text().count(" 210#") >= log.samples, "every sample is answered")
    totals = process.stop()
    assert not [name for name in ("overflowed", "unsent", "outages", "corrupt") if totals[name]]
    assert [frame for frame in rig.frames(recorded) if frame[:3] in INPUTS] == rig.frames(log.path)

    replay = ("--settings", log.settings, "--format", "csv", "-o")
    lever("replay", log.path, *replay, tmp_path / "replay")
    assert answers(tmp_path / "replay/bus.log") == answers(recorded)

    output = lever("replay", recorded, *replay, tmp_path / "again")
    assert answers(tmp_path / "again/bus.log") == answers(recorded)
    assert "PILOT" not in output
    assert "others" not in output


@pytest.mark.requires("canplayer", "cansend")
def test_record_has_every_frame_of_a_real_bus(log: Log, start: rig.Starter, interface: str, tmp_path: Path) -> None:
    process = start("--settings", str(log.settings))
    path, partial = tmp_path / "session.log", tmp_path / "session.log.partial"
    command = [LEVER, "record", "--interface", "socketcan", "--channel", interface, "-o", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as recorder:
        rig.wait_until(partial.exists, "it records")
        play(log, interface)
        subprocess.run(["cansend", interface, "20000004#0001000000000000"], check=True)  # an overflow of the controller
        rig.wait_until(lambda: partial.read_text().count(" 210#") >= log.samples, "every answer is recorded")
        process.stop()
        subprocess.run(["cansend", interface, rig.MARKER], check=True)
        rig.wait_until(lambda: f" {rig.MARKER}" in partial.read_text(), "all that was sent before is recorded")
        recorder.send_signal(signal.SIGINT)
        output, errors = recorder.communicate(timeout=rig.PATIENCE_S)
    assert recorder.returncode == 0, errors
    said = " ".join(output.split())
    assert ", 0 lost, 0 corrupt, 1 error frames, " in said
    assert "1 overflows of the controller" in said
    assert [frame for frame in rig.frames(path) if frame[:3] in INPUTS] == rig.frames(log.path)
    lever("replay", path, "--settings", log.settings, "--format", "csv", "-o", tmp_path / "replay")
    assert answers(tmp_path / "replay/bus.log") == answers(path)
