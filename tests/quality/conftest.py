"""What README files and examples of --help find when a test follows them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import can
import cantools
import numpy as np
import pytest
from lever_sil.run import buslog
from lever_sil.run.runner import SimulationResult, simulate
from lever_sil.scenarios import scenario
from quality import tools

AIRCRAFT = """VERSION ""
BU_: FCC
BO_ 256 LEVER: 4 FCC
 SG_ Angle : 0|16@1- (0.005,0) [-160|160] "deg" FCC
 SG_ LeverCounter : 16|8@1+ (1,0) [0|255] "" FCC
BO_ 257 IMU: 4 FCC
 SG_ AccZ : 0|16@1- (0.001,0) [-32|32] "m/s^2" FCC
 SG_ AccX : 16|16@1- (0.001,0) [-32|32] "m/s^2" FCC
BO_ 258 MOTOR: 2 FCC
 SG_ Torque : 0|16@1- (0.001,0) [-32|32] "N m" FCC
"""


SourceTree = Callable[[str], Path]


@pytest.fixture(scope="session")
def _made(
    tmp_path_factory: pytest.TempPathFactory, build_dir: Path, recording: Path, aircraft: Path
) -> Callable[[str], Path]:
    """Make the folders of source_tree()."""

    @cache
    def make(name: str) -> Path:
        folder = tmp_path_factory.mktemp(name, numbered=False)
        for entry in tools.ROOT.iterdir():
            if entry.name not in ("build", "out") and not entry.name.startswith("."):
                (folder / entry.name).symlink_to(entry)
        (folder / "build").symlink_to(build_dir)
        (folder / "out").mkdir()
        shutil.copy(recording, folder / "out/session.log")
        shutil.copytree(aircraft, folder, dirs_exist_ok=True)
        (folder / "quick.toml").write_text(quick_campaign(), encoding="utf-8")
        return folder

    return make


@pytest.fixture
def source_tree(_made: SourceTree, build_dir: Path, monkeypatch: pytest.MonkeyPatch) -> SourceTree:
    """source_tree(name): a folder that looks like the source tree, with a recording out/session.log and files of a
    user's own; the same for the same name. The commands of the virtual environment are found meanwhile."""
    monkeypatch.setenv("PATH", f"{build_dir}/venv/bin:{os.environ['PATH']}")
    monkeypatch.setenv("PYTEST_ADDOPTS", "--collect-only")
    return _made


def quick_campaign() -> str:
    """Return the spec of that name with 9 of its 100 flights."""
    text = (tools.ROOT / "sil/lever_sil/campaign/specs/quick.toml").read_text(encoding="utf-8")
    return text.replace("steps = 5", "steps = 3").replace("seeds = 4", "seeds = 1")


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a second of a simulation, estimates included, as candump would have recorded them."""
    folder = tmp_path_factory.mktemp("recording")
    simulated(folder, 1)
    return folder / "bus.log"


@pytest.fixture(scope="session")
def aircraft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the same lever as an aircraft records it that knows nothing of lever.dbc: a database, and logs."""
    folder = tmp_path_factory.mktemp("aircraft")
    (folder / "aircraft.dbc").write_text(AIRCRAFT, encoding="ascii")
    trace = simulated(folder, 21).trace
    (folder / "bus.log").rename(folder / "flight.log")
    names = ("time_s", "theta_measured_rad", "z_ddot_measured_m_s2", "tau_m_measured_N_m")
    time, theta, z_ddot, tau_m = (trace[name][::2] for name in names)
    rows = np.column_stack((time, theta, z_ddot / 9.80665 + 1))
    np.savetxt(folder / "flight.csv", rows, "%.6f", ",", header="time,angle [rad],acc", comments="")
    (folder / "aircraft.toml").write_text(
        '[theta]\nsignal = "LEVER.Angle"\n[z_ddot]\nsignal = "IMU.AccZ"\n', encoding="utf-8"
    )
    database = cantools.database.load_string(AIRCRAFT, "dbc")
    assert isinstance(database, cantools.database.Database)
    (folder / "monday").mkdir()
    logs = [can.Logger(folder / name) for name in ("flight.blf", "monday/1.blf", "monday/2.blf")]
    for k, at in enumerate(time):
        signals = {
            "LEVER": {"Angle": np.degrees(theta[k]), "LeverCounter": k % 256},
            "IMU": {"AccZ": z_ddot[k] + 9.80665, "AccX": 0.1},
            "MOTOR": {"Torque": tau_m[k]},
        }
        for name, values in signals.items():
            kind = database.get_message_by_name(name)
            message = can.Message(
                timestamp=1e9 + at,
                arbitration_id=kind.frame_id,
                is_extended_id=False,
                data=kind.encode(values),
            )
            for log in logs if k < 2000 else logs[:1]:
                log.on_message_received(message)
    for log in logs:
        log.stop()
    return folder


def simulated(folder: Path, seconds: float) -> SimulationResult:
    """Return a run, which leaves its log in a folder."""
    steady = scenario.load("steady", [f"duration={seconds} s", "converged_after=0.5 s", "limits={}"])
    result = simulate(steady, channel="vcan0")
    (folder / "bus.log").write_bytes(b"".join(buslog.lines(result.frames, "vcan0")))
    return result
