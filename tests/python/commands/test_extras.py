"""Without an extra: what needs it says so in one line with the command that installs it, and the rest works."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from lever_cdkf.runtime.extras import PACKAGES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

pytestmark = pytest.mark.usefixtures("installed")

Python = Callable[..., subprocess.CompletedProcess[str]]
Without = Callable[..., Python]

_BLOCKER = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {packages}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)

sys.meta_path.insert(0, Blocker())
"""
_STATUSES = """
import json, sys
from lever_cdkf.cli.main import main
statuses = [main(arguments) for arguments in json.loads(sys.argv[1])]
print(*statuses)
"""


@pytest.fixture
def without(tmp_path: Path) -> Without:
    """without(*extras): Python in an installation that has none of their packages."""

    def make(*extras: str) -> Python:
        packages = {package for extra in extras for package in PACKAGES[extra]}
        (tmp_path / "sitecustomize.py").write_text(_BLOCKER.format(packages=packages))
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}

        def python(*arguments: str) -> subprocess.CompletedProcess[str]:
            command = [sys.executable, "-c", *arguments]
            return subprocess.run(command, capture_output=True, text=True, check=False, env=environment, cwd=tmp_path)

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
    """Return the names of its packages, and of those of the extras it has in it."""
    found: list[str] = []
    for requirement in extras[extra]:
        inner = re.fullmatch(r"lever-cdkf\[(\w+)\]", requirement)
        found += packages(extras, inner[1]) if inner else [re.split(r"[<>=]", requirement)[0]]
    return found


@pytest.mark.parametrize(
    ("extra", "arguments"),
    [
        ("campaign", "campaign quick"),
        ("files pyarrow", "replay flight.parquet"),
        ("files scipy", "replay flight.mat"),
        ("files mcap", "sim steady --out sim --format mcap"),
        ("live", "live --scenario demo"),
        ("live", "monitor --scenario demo"),
        ("mf4", "replay session.mf4"),
        ("mf4", "sim steady --out sim --format mf4"),
        ("report", "demo"),
        ("report", "bounce --quick -o out"),
        ("report", "envelope --quick -o out"),
        ("report", "tune session.log --page page.html"),
        ("study", "compare --quick"),
        ("study", "figures"),
        ("tune", "tune session.log"),
    ],
)
def test_a_missing_extra(
    extra: str,
    arguments: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    extra, *needed = extra.split()

    def find_spec(_: object, name: str, *_more: object) -> None:
        if name.partition(".")[0] in PACKAGES[extra]:
            raise ModuleNotFoundError(name)

    for package in PACKAGES[extra]:
        monkeypatch.delitem(sys.modules, package, raising=False)
    monkeypatch.setattr(sys, "meta_path", [type("Blocker", (), {"find_spec": find_spec})(), *sys.meta_path])
    monkeypatch.chdir(tmp_path)
    for name in ("session.mf4", "flight.parquet", "flight.mat"):
        (tmp_path / name).write_text("a log")
    assert main(arguments.split()) == 2
    names = " and ".join(needed or PACKAGES[extra])
    assert capsys.readouterr() == (
        "",
        f'lever: error: this needs {names}: {sys.executable} -m pip install "lever-cdkf[{extra}]"\n',
    )


def test_the_commands_of_the_base_installation(without: Without, tmp_path: Path) -> None:
    """Files that need an extra are left out, and those of an earlier run do not stay."""
    (tmp_path / "sim").mkdir()
    (tmp_path / "sim/report.html").touch()
    listings: tuple[str, ...] = (
        "--help",
        "settings",
        "dbc",
        "sim --list",
        "bounce --list",
        "envelope --list",
        "sim steady --help",
    )
    listings += ("campaign --list", "compare --list", "figures --list")
    short = "--set duration=3s --set limits={} --out sim"
    lines = (
        *listings,
        f"sim unknown_torque {short}",
        f"sim steady {short}",
        "replay sim/bus.log -o replay",
        "replay sim/trace.csv --map theta=theta_measured_rad z_ddot=z_ddot_measured_m_s2",
        "monitor sim/bus.log --once",
        "record --interface lever --channel x -o record.log",
    )
    done = without(*PACKAGES)(_STATUSES, json.dumps([line.split() for line in lines]))
    assert done.stdout.splitlines()[-1] == " ".join([*"0" * (len(lines) - 1), "2"])
    pip = f"{sys.executable} -m pip"
    report = f'lever: warning: no report.html: this needs plotly: {pip} install "lever-cdkf[report]"\n'
    refused = "lever: error: interface lever stays inside one process"  # not: is missing
    assert done.stderr.partition(refused)[:2] == (3 * report, refused)
    assert "Written to sim: summary.json, trace.csv, bus.log\n" in done.stdout
    for folder in ("sim", "replay"):
        assert sorted(os.listdir(tmp_path / folder)) == ["bus.log", "summary.json", "trace.csv"]


def test_importing_python_can_loads_nothing_of_this_package(without: Without) -> None:
    """The plug-in is known by name until a bus is opened; asammdf, which python-can itself loads, is an extra."""
    code = "import sys, can; assert 'lever' in can.VALID_INTERFACES; print(*sys.modules)"
    modules = {name.partition(".")[0] for name in without("mf4")(code).stdout.split()}
    assert "can" in modules
    assert not modules & {"lever_cdkf", "numpy", "cffi", "cantools", "rich"}


def test_commands_do_not_load_asammdf_for_nothing(without: Without) -> None:
    code = (
        "import sys; from lever_cdkf.cli.main import main\n"
        "main(['sim', 'steady', '--set', 'duration=1 s', '--set', 'limits={}'])\n"
        "print('can' in sys.modules, 'asammdf' in sys.modules)"
    )
    assert without()(code).stdout.splitlines()[-1] == "True False"
