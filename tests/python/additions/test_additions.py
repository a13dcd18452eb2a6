"""Where a new thing goes: what the READMEs of sil and host_tools say of it, followed in a copy of the packages.
What is added there is listed, runs, and shows in the report."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from lever_cdkf.runtime.files import LIBRARY_DIR, native_file

SCENARIO = """
title = "A seesaw"
description = "All that is new at once."
duration = "4 s"
converged_after = "1 s"
[pilot]
model = "seesaw"
trim = "20 deg"
k_seat = { kind = "vee", first = "2000 N/m", last = "1500 N/m" }
m_seat = "2 kg"
[[base]]
kind = "square"
rms = "0.1 g"
frequency = "3 Hz"
[sensors.theta]
noise = "1 mrad"
fault = [{ kind = "lean", by = "1 mrad", start = "2 s" }]
[limits]
natural_frequency = "1000 %"
"""
PLANT = '''
"""A truth of the test: a mass on a spring."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from .linear_plant import LinearTruth, System


@dataclass(frozen=True)
class Seesaw(LinearTruth):
    model = "seesaw"
    m_seat: FloatArray
    k_seat: FloatArray
    trim: FloatArray

    @property
    def parameters(self) -> Mapping[str, FloatArray]:
        return {"m_seat": self.m_seat, "k_seat": self.k_seat}

    @property
    def system(self) -> System:
        one = np.ones_like(self.m_seat)
        return System(self.k_seat / self.m_seat, 8.0 * one, -one, 1.0 / self.m_seat, self.trim)
'''
PILOT = '''
@dataclass(frozen=True, kw_only=True)
class SeesawPilot(Pilot):
    """A mass on a spring."""

    model = "seesaw"
    about = "a seesaw, which nobody expected"
    signs: ClassVar[Mapping[str, int]] = {"m_seat": 1, "k_seat": 1}
    m_seat: Trajectory = item(read_trajectory(), "kg")
    k_seat: Trajectory = item(read_trajectory(), "N/m")

    def build(self, time, values, trim, lever):
        return seesaw_plant.Seesaw(**values, trim=trim)


_ALL = (SeesawPilot, '''
TRAJECTORY = '''
@dataclass(frozen=True)
class Vee(Trajectory):
    """Down and up again, with a little noise of its own."""

    first: float = quantity(SIGNAL)
    last: float = quantity(SIGNAL)

    def values(self, time, rng):
        middle = 0.5 * time[-1]
        return self.first + (self.last - self.first) * (1 - abs(time - middle) / middle) + rng.standard_normal()


KINDS: Mapping[str, type[Trajectory]] = {
    "vee": Vee,'''
EXCITATION = '''
@dataclass(frozen=True, kw_only=True)
class Square(Excitation):
    """Up and down."""

    rms: float = quantity(SIGNAL, least=0.0)
    frequency: float = quantity("Hz", above=0.0)

    def scaled(self, time, rng):
        return self.rms * np.sign(np.sin(2.0 * np.pi * self.frequency * time))


KINDS: dict[str, type[Excitation]] = {
    "square": Square,'''
FAULT = '''
@dataclass(frozen=True, kw_only=True)
class Lean(Fault):
    """Off by so much."""

    by: float = quantity(SIGNAL)

    def corrupt(self, inside, corruption, rng):
        corruption.offset[inside] += self.by


FAULTS: dict[str, type[Fault]] = {
    "lean": Lean,'''
BASELINE = '''
"""An estimator of the test: the first guess. Source: none."""

import numpy as np

from ..data import Estimates


def guess(batch, at):
    raise NotImplementedError
'''
CHART = '''
"""The rate of the lever."""

from ..figure import Figure, axis, line, time_axis


def rate(run):
    figure = Figure([axis("rate [rad/s]")], time_axis(run.end), 200)
    figure.add(line(run.time, run.column("theta_dot_estimate_rad_s"), "rate", "estimate"))
    return figure
'''
COMMAND = '''
"""`lever hello`."""


def add_parser(subparsers):
    subparsers.add_parser("hello", help="says hello")


def run(args):
    print("hello")
    return 0
'''
END = "the end of a command"
RUN = """
import json
import os
import sys
sys.meta_path[:] = [each for each in sys.meta_path if "Editable" not in type(each).__name__ + type(each).__module__
                    and "Redirecting" not in type(each).__name__]
sys.path[:0] = sys.argv.pop(1).split(os.pathsep)
from lever_cdkf.cli.main import main
for arguments in json.loads(sys.argv[1]):
    try:
        status = main(arguments)
    except SystemExit as error:
        status = error.code
    if status:
        sys.exit(status)
    print(sys.argv[2], flush=True)
"""


class Copy:
    """The packages, to be added to."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.folder = folder
        for name in ("host_tools", "sil"):
            shutil.copytree(root / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "c"))

    def file(self, path: str, text: str) -> None:
        (self.folder / path).write_text(text.lstrip("\n"), encoding="utf-8")

    def change(self, path: str, old: str, new: str) -> None:
        file = self.folder / path
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{path}: {old}"
        file.write_text(text.replace(old, new), encoding="utf-8")

    def lever(self, *commands: list[str]) -> list[str]:
        """Return what each command says, of this copy, in one process for all."""
        environment = {**os.environ, LIBRARY_DIR: str(native_file("lever.dbc").parent), "COLUMNS": "200"}
        packages = os.pathsep.join(str(self.folder / name) for name in ("host_tools", "sil"))
        command = [sys.executable, "-c", RUN, packages, json.dumps(commands), END]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, cwd=self.folder)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout.split(f"{END}\n")[:-1]


@pytest.fixture(scope="module")
def copy(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Copy:
    project = Copy(root, tmp_path_factory.mktemp("additions"))
    project.file("sil/lever_sil/scenarios/seesaw.toml", SCENARIO)
    project.file("sil/lever_sil/plants/seesaw_plant.py", PLANT)
    pilots = "sil/lever_sil/plants/pilots.py"
    project.change(pilots, "mayo_plant, reflex_plant,", "mayo_plant, seesaw_plant, reflex_plant,")
    project.change(pilots, "\n_ALL = (", PILOT)
    project.change("sil/lever_sil/plants/trajectories.py", "\nKINDS: Mapping[str, type[Trajectory]] = {", TRAJECTORY)
    project.change("sil/lever_sil/plants/excitation.py", "\nKINDS: dict[str, type[Excitation]] = {", EXCITATION)
    project.change("sil/lever_sil/plants/sensors.py", "\nFAULTS: dict[str, type[Fault]] = {", FAULT)
    project.change(
        "host_tools/lever_cdkf/results/trace.py",
        "\nHEALTH = (\n",
        '\nHEALTH = (\n    ("gap", "HEALTH", "fault_gap"),\n',
    )
    project.file("sil/lever_sil/study/baselines/guess.py", BASELINE)
    baselines = "sil/lever_sil/study/baselines/__init__.py"
    project.change(baselines, "from .joint_ekf", "from .guess import guess\nfrom .joint_ekf")
    project.change(
        baselines, "    for baseline in (\n", '    for baseline in (\n        Baseline("guess", "it", "none", guess),\n'
    )
    project.change(
        "sil/lever_sil/envelope/conditions.py",
        "\n_STEADY = (",
        '\n_STEADY = (\n    Condition("calm", "no motion", Motion()),',
    )
    project.change(
        "sil/lever_sil/study/compare/cases.py",
        "def _steps() -> Iterator[Case]:\n",
        'def _steps() -> Iterator[Case]:\n    yield Matched(name="wronger", title="wronger", kind="wrong noise")\n',
    )
    clock = "    clock = readings.clock\n"
    project.change("sil/lever_sil/faults/rows.py", clock, f'    yield Row("sulk", "it sulks")\n{clock}')
    project.change(
        "sil/lever_sil/bounce/conditions.py",
        "\n_ALARMS = (",
        '\n_ALARMS = (\n    Condition("mild", "mild", measure.relaxing),',
    )
    shutil.copy(
        root / "sil/lever_sil/campaign/specs/quick.toml", project.folder / "sil/lever_sil/campaign/specs/slow.toml"
    )
    project.file("host_tools/lever_cdkf/report/charts/speed.py", CHART)
    page = "host_tools/lever_cdkf/report/page.py"
    project.change(page, "import health,", "import health, speed,")
    section = 'page.section("speed", "Speed", "Speed", page.figure("figure-speed", speed.rate(run), "It."))'
    project.change(page, "    _health(page, run)\n", f"    {section}\n    _health(page, run)\n")
    project.change("host_tools/lever_cdkf/can/logs.py", '_CANDUMP = (".log",', '_CANDUMP = (".dump", ".log",')
    project.file("sil/lever_sil/commands/hello.py", COMMAND)
    entries = project.folder / "sil/hello-1.dist-info"
    entries.mkdir()
    (entries / "METADATA").write_text("Metadata-Version: 2.1\nName: hello\nVersion: 1\n")
    (entries / "entry_points.txt").write_text("[lever_cdkf.commands]\nhello = lever_sil.commands.hello\n")
    return project


def test_a_scenario_with_a_new_plant_trajectory_excitation_fault_and_column_runs(copy: Copy) -> None:
    copy.lever(["sim", "seesaw", "--out", "out"])
    summary = json.loads((copy.folder / "out/summary.json").read_text())
    assert summary["truth"]["model"] == "seesaw"
    assert summary["samples"] == 4000
    header, *rows = (copy.folder / "out/trace.csv").read_text().splitlines()
    gap = header.split(",").index("gap")
    assert rows[-1].split(",")[gap] == "0.000000"
    report = (copy.folder / "out/report.html").read_text()
    assert "a seesaw, which nobody expected" in report
    assert "figure-speed" in report
    (copy.folder / "out/bus.log").rename(copy.folder / "bus.dump")
    copy.lever(["replay", "bus.dump", "--out", "again"])
    assert ",gap," in (copy.folder / "again/trace.csv").read_text().splitlines()[0]


@pytest.fixture(scope="module")
def said(copy: Copy) -> dict[str, str]:
    """Return what the lists, the help and the new command say."""
    lists = ("sim", "compare", "envelope", "bounce", "faults", "campaign")
    commands = {**{name: [name, "--list"] for name in lists}, "": ["--help"], "hello": ["hello"]}
    return dict(zip(commands, copy.lever(*commands.values()), strict=True))


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("sim", "A seesaw"),
        ("compare", "guess"),
        ("compare", "wronger"),
        ("envelope", "calm "),
        ("bounce", "mild "),
        ("faults", "sulk "),
        ("campaign", "slow "),
    ],
)
def test_a_row_or_a_file_is_listed(command: str, name: str, said: dict[str, str]) -> None:
    """A scenario, an estimator, a case, a condition of the envelope or of the flights, a fault, a campaign."""
    assert name in said[command]


def test_a_command_is_one_of_levers(said: dict[str, str]) -> None:
    assert "says hello" in said[""]
    assert said["hello"] == "hello\n"


@pytest.mark.parametrize(
    ("page", "pattern"),
    [
        ("firmware/can/README.md", r'"STABILITY"|(MESSAGE|OUTPUT|message)_STABILITY|\bSTABILITY,'),
        ("firmware/model/README.md", r"LEVER_MODEL_LINEAR_BLACK_BOX|model_linear_black_box|\bb21\b"),
        ("firmware/README.md", r"\bdamping_gain\b"),
    ],
    ids=["message", "model", "setting"],
)
def test_a_page_names_every_file_that_has_to_know(page: str, pattern: str, root: Path) -> None:
    """Of a message, a model and a setting that there are: what has their names in it."""
    said = (root / page).read_text(encoding="utf-8")
    files = [each for folder in ("firmware", "host_tools") for each in (root / folder).rglob("*") if each.is_file()]
    knowing = [each for each in files if each.suffix in (".c", ".h", ".py", ".def")]
    knowing = [each for each in knowing if re.search(pattern, each.read_text(encoding="utf-8"))]
    assert len(knowing) > 1
    assert [str(each.relative_to(root)) for each in knowing if each.name not in said] == []
