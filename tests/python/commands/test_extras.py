"""Without an extra: what needs it says so in one line with the command that installs it, and the rest works."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from lever_cdkf.host_tools.extras import PACKAGES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

pytestmark = pytest.mark.usefixtures("installed")

Python = Callable[..., subprocess.CompletedProcess[str]]
Without = Callable[..., Python]

LEVER = ("-m", "lever_cdkf.host_tools.cli")

_BLOCKER = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {packages}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)

sys.meta_path.insert(0, Blocker())
"""


@pytest.fixture
def without(tmp_path: Path) -> Without:
    """without(*extras): Python in an installation that has none of their packages."""

    def make(*extras: str) -> Python:
        packages = {package for extra in extras for package in PACKAGES[extra]}
        (tmp_path / "sitecustomize.py").write_text(_BLOCKER.format(packages=packages))
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}

        def python(*arguments: str) -> subprocess.CompletedProcess[str]:
            command = [sys.executable, *arguments]
            return subprocess.run(
                command, capture_output=True, text=True, check=False, env=environment, cwd=tmp_path, timeout=120
            )

        return python

    return make


def test_the_extras_are_those_of_pyproject(root: Path) -> None:
    extras = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    everything = extras.pop("all")
    assert everything == [f"lever-cdkf[{','.join(sorted(PACKAGES))}]"]
    assert {extra: set(packages(extras, extra)) for extra in extras} == {
        extra: set(names) for extra, names in PACKAGES.items()
    }


def packages(extras: dict[str, list[str]], extra: str) -> list[str]:
    """The names of its packages, and of those of the extras it has in it."""
    found: list[str] = []
    for requirement in extras[extra]:
        inner = re.fullmatch(r"lever-cdkf\[(\w+)\]", requirement)
        found += packages(extras, inner[1]) if inner else [re.split(r"[<>=]", requirement)[0]]
    return found


@pytest.mark.parametrize(
    ("extra", "arguments"),
    [
        ("files", "replay flight.parquet"),
        ("files", "replay flight.mat"),
        ("live", "live --scenario demo"),
        ("live", "monitor --scenario demo"),
        ("mf4", "replay session.mf4"),
        ("report", "demo"),
        ("report", "envelope --quick"),
        ("report", "tune session.log --page page.html"),
        ("study", "compare --quick"),
        ("study", "figures"),
        ("tune", "tune session.log"),
    ],
)
def test_a_missing_extra(without: Without, extra: str, arguments: str, tmp_path: Path) -> None:
    (tmp_path / "session.mf4").write_text("a log")
    done = without(extra)(*LEVER, *arguments.split())
    assert (done.returncode, done.stdout) == (2, "")
    names = " and ".join(PACKAGES[extra])
    assert done.stderr == f'lever: error: this needs {names}: pip install "lever-cdkf[{extra}]"\n'


def test_the_commands_of_the_base_installation(without: Without, tmp_path: Path) -> None:
    """Files that need an extra are left out, and those of an earlier run do not stay."""
    lever = partial(without(*PACKAGES), *LEVER)
    for command in (
        ["--help"],
        ["settings"],
        ["dbc"],
        ["sim", "--list"],
        ["envelope", "--list"],
        ["sim", "steady", "--help"],
    ):
        done = lever(*command)
        assert (done.returncode, done.stderr) == (0, "")
    (tmp_path / "sim").mkdir()
    (tmp_path / "sim/report.html").touch()
    report = 'lever: warning: no report.html: this needs plotly: pip install "lever-cdkf[report]"\n'
    mf4 = 'lever: warning: no signals.mf4: this needs asammdf: pip install "lever-cdkf[mf4]"\n'
    for name in ("unknown_torque", "steady"):
        done = lever("sim", name, "--set", "duration=3 s", "--set", "limits={}", "--out", "sim")
        assert (done.returncode, done.stderr) == (0, report)
        assert sorted(os.listdir(tmp_path / "sim")) == ["bus.log", "summary.json", "trace.csv"]
    assert done.stdout.endswith("Written to sim: summary.json, trace.csv, bus.log\n")
    done = lever("replay", "sim/bus.log", "-o", "replay")
    assert (done.returncode, done.stderr) == (0, mf4 + report)
    assert sorted(os.listdir(tmp_path / "replay")) == ["bus.log", "summary.json", "trace.csv"]
    done = lever("replay", "sim/trace.csv", "--map", "theta=theta_measured_rad", "z_ddot=z_ddot_measured_m_s2")
    assert (done.returncode, done.stderr) == (0, "")
    done = lever("monitor", "sim/bus.log", "--once")
    assert (done.returncode, done.stderr) == (0, "")
    done = lever("record", "--interface", "lever", "--channel", "x", "--duration", "0.5", "-o", "record.log")
    assert (done.returncode, "inside one process" in done.stderr) == (2, True)  # it is refused, not missing


def test_importing_python_can_loads_nothing_of_this_package(without: Without) -> None:
    """The plug-in is known by name until a bus is opened; asammdf, which python-can itself loads, is an extra."""
    code = "import sys, can; assert 'lever' in can.VALID_INTERFACES; print(*sys.modules)"
    modules = {name.partition(".")[0] for name in without("mf4")("-c", code).stdout.split()}
    assert "can" in modules
    assert not modules & {"lever_cdkf", "numpy", "cffi", "cantools", "rich"}


def test_commands_do_not_load_asammdf_for_nothing(without: Without) -> None:
    code = (
        "import sys; from lever_cdkf.host_tools import cli\n"
        "cli.main(['sim', 'steady', '--set', 'duration=1 s', '--set', 'limits={}'])\n"
        "print('can' in sys.modules, 'asammdf' in sys.modules)"
    )
    assert without()("-c", code).stdout.splitlines()[-1] == "True False"
