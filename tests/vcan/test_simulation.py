"""The whole loop over a virtual CAN interface: plant and firmware in two processes, candump recording beside them.

Everything is compared with a run in one process (`--interface lever`), and must be the same to the bit.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import pytest
from lever_sil.run import buslog
from lever_sil.run.runner import simulate
from lever_sil.scenarios import scenario
from processes import lever
from vcan import rig

SHORTENED = {
    "steady": {"duration": "0.8 s"},
    "fixed_preload": {"duration": "0.5 s", "settings.sample_period": "4 ms"},
    "sensor_dropout": {
        "duration": "1.7 s",
        "sensors.dropout.2.start": "0.5 s",  # theta
        "sensors.dropout.2.end": "0.8 s",
        "sensors.dropout.3.start": "1 s",  # theta_dot
        "sensors.dropout.3.end": "1.3 s",
        "sensors.dropout.4.start": "1.5 s",  # LEVER_SAMPLE
        "sensors.dropout.4.end": "1.6 s",
    },
}


def lever_sim(name: str, *options: str) -> str:
    """Return what `lever sim` prints about a short version of the scenario."""
    changes = [f"--set={key}={value}" for key, value in SHORTENED[name].items()]
    return lever("sim", name, *changes, *options)


@functools.cache
def in_process(name: str) -> str:
    """Return the log of the same run in one process, as on the interface of the tests."""
    run = simulate(scenario.load(name, [f"{key}={value}" for key, value in SHORTENED[name].items()]))
    return b"".join(buslog.lines(run.frames, rig.INTERFACE)).decode()


def settings_file(name: str, folder: Path) -> str:
    """Return a file with the settings of the scenario, for lever_can."""
    path = folder / "settings"
    path.write_text(lever_sim(name, "--settings"))
    return str(path)


@dataclass(frozen=True)
class Runs:
    """A scenario, run over the interface."""

    scenario: str
    over_can: Path
    """The folder that it has written."""
    candump: Path
    totals: dict[str, int]
    """The last line of lever_can."""


@pytest.fixture(scope="module", params=["steady", "sensor_dropout"])
def runs(request: pytest.FixtureRequest, build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Runs:
    name: str = request.param
    folder = tmp_path_factory.mktemp(name)
    over_can, recorded = folder / "over_can", folder / "candump.log"
    options = ["--settings", settings_file(name, folder)]
    with rig.new_interface() as interface, rig.LeverCan(build_dir / "lever_can", interface, options, folder) as process:
        with rig.candump(interface, recorded):
            lever_sim(name, "--interface=socketcan", f"--channel={interface}", f"--out={over_can}")
        totals = process.stop()
    return Runs(name, over_can, recorded, totals)


@pytest.mark.requires("candump", "cansend")
def test_candump_records_the_frames_of_the_run(runs: Runs) -> None:
    recorded = rig.frames(runs.candump)
    assert recorded == rig.frames(runs.over_can / "bus.log")
    assert len(recorded) == runs.totals["frames in"] + runs.totals["frames out"]
    assert not [name for name in ("overflowed", "unsent", "outages", "corrupt") if runs.totals[name]]


def test_the_frames_are_those_of_a_run_in_one_process(runs: Runs) -> None:
    assert (runs.over_can / "bus.log").read_text() == in_process(runs.scenario)


def test_a_process_that_has_run_before_serves_the_next_run(start: rig.Starter, interface: str, tmp_path: Path) -> None:
    process = start("--settings", settings_file("fixed_preload", tmp_path))
    for out in ("one", "two"):
        lever_sim("fixed_preload", "--interface=socketcan", f"--channel={interface}", f"--out={tmp_path / out}")
    assert (tmp_path / "one/trace.csv").read_bytes() == (tmp_path / "two/trace.csv").read_bytes()
    assert process.stop()["samples"] > 2 * 125 + 1250  # it rests for 5 s of samples in between
