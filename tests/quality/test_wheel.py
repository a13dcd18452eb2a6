"""The Python package as its users install it: from the source distribution, as a wheel."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path

import pytest
from conftest import Built
from quality import tools

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

NATIVE = ("lever.dbc", "lever_cdkf", "lever_bulk", "lever_innovations", "lever_loop")


@pytest.fixture(scope="module")
def installed(built: Built) -> Path:
    """Return a folder with the package and nothing else, made by package/wheel.py."""
    return built("wheel_test/installed", "build.wheel")


def test_the_source_distribution_has_what_builds_the_package(installed: Path) -> None:
    (sdist,) = installed.parent.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {Path(name).relative_to(Path(name).parts[0]) for name in archive.getnames()}
    assert {Path(name) for name in ("CMakeLists.txt", "pyproject.toml", "LICENSE", "README.md")} <= names
    assert not {name.parts[0] for name in names} & {"tests", "build", ".ci"}


def files_of(folder: Path) -> set[Path]:
    return {file.relative_to(folder) for file in folder.rglob("*") if file.is_file() and file.suffix != ".pyc"}


def test_the_wheel_has_every_file_of_the_tree_and_the_libraries(installed: Path) -> None:
    files = {each for each in files_of(installed) if each.parts[0] in ("lever_cdkf", "lever_sil")}
    native = {file for file in files if file.is_relative_to("lever_cdkf/_native")}
    core = {file.relative_to("lever_cdkf/_native/sources") for file in native if "sources" in file.parts}
    assert {Path("lever_cdkf.h"), Path("lever_settings.def"), Path("app/lever.c"), Path("can/e2e.h")} <= core
    assert all((tools.ROOT / "firmware" / file).is_file() for file in core)
    libraries = {name for name in NATIVE if any(name in file.name for file in native)}
    assert libraries == set(NATIVE), native
    settings = tomllib.loads((tools.ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["scikit-build"]
    folders = [tools.ROOT / folder for folder in settings["wheel"]["packages"]]
    tree = {Path(folder.name) / file for folder in folders for file in files_of(folder)}
    assert {file for file in files if file not in native} == tree


def test_the_wheel_works(installed: Path, tmp_path: Path) -> None:
    """In an environment that has the packages of this one, but not its editable installation."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    python = tmp_path / "venv/bin/python"
    (folder,) = (tmp_path / "venv/lib").glob("python*/site-packages")
    (folder / "packages.pth").write_text(f"{installed}\n{sysconfig.get_path('purelib')}\n")
    where = "import lever_cdkf, lever_sil; print(*lever_cdkf.__path__, *lever_sil.__path__)"
    paths = subprocess.run([python, "-c", where], capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    assert paths.split() == [str(installed / name) for name in ("lever_cdkf", "lever_sil")]
    lever: list[str | Path] = [python, "-m", "lever_cdkf.cli.main"]
    short = ("--set", "duration=1 s", "--set", "limits={}")
    tools.assert_silent([*lever, "sim", "steady", *short, "--out", "sim"], cwd=tmp_path)
    tools.assert_silent([*lever, "replay", "sim/bus.log", "-o", "replay"], cwd=tmp_path)
    assert (tmp_path / "replay/bus.log").read_bytes() == (tmp_path / "sim/bus.log").read_bytes()
