"""Running a checking tool over files of the project; what the tests of this folder share."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
CORE = ("math", "model", "filter", "can", "app")
"""The folders of firmware/ that run on every machine."""


def core_sources() -> list[Path]:
    return [source for folder in CORE for source in sorted((FIRMWARE / folder).glob("*.c"))]


def c_files() -> list[Path]:
    """Every C file and header of the project."""
    folders = (FIRMWARE, ROOT / "host_tools", ROOT / "tests")
    return [file for folder in folders for suffix in "ch" for file in sorted(folder.rglob(f"*.{suffix}"))]


def python_tool(name: str) -> str:
    """A program that is installed in the virtual environment that runs the tests."""
    return str(Path(sys.executable).with_name(name))


def first_installed(names: str) -> str:
    """The first of the programs "a|b|c" that is there."""
    return next(path for name in names.split("|") if (path := shutil.which(name)))


def run(command: Iterable[str | Path], cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """The finished process, with stdout and stderr together as its stdout."""
    arguments = [str(part) for part in command]
    return subprocess.run(arguments, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)


def assert_silent(command: Iterable[str | Path], cwd: Path = ROOT) -> None:
    """Fails, showing what the tool says, unless it exits with 0."""
    result = run(command, cwd)
    if result.returncode != 0:
        pytest.fail(f"{shlex.join(result.args)[:160]}\n{result.stdout}", pytrace=False)
