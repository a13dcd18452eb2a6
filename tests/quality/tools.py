"""Running a checking tool over files of the project; what the tests of this folder share."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
CORE = ("math", "model", "filter", "bounce", "can", "app")
"""The folders of firmware/ that run on every machine."""


def core_sources() -> list[Path]:
    return [source for folder in CORE for source in sorted((FIRMWARE / folder).glob("*.c"))]


def core_flags(build_dir: Path) -> list[str]:
    """Return what the build compiles the core with, but for optimisation; firmware/ is where it looks for headers."""
    entries = json.loads((build_dir / "compile_commands.json").read_text(encoding="utf-8"))
    commands = [shlex.split(entry["command"]) for entry in entries if entry["file"] == str(FIRMWARE / "filter/cdkf.c")]
    command = next(words for words in commands if "CMakeFiles/lever_cdkf.dir/" in words[words.index("-o") + 1])
    return [word for word in command[1 : command.index("-o")] if not word.startswith(("-O", "-g"))]


def python_tool(name: str) -> str:
    """Return a program that is installed in the virtual environment that runs the tests."""
    return str(Path(sys.executable).with_name(name))


def first_installed(names: str) -> str:
    """Return the first of the programs "a|b|c" that is there."""
    return next(path for name in names.split("|") if (path := shutil.which(name)))


def run(command: Iterable[str | Path], cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Return the finished process, with stdout and stderr together as its stdout."""
    arguments = [str(part) for part in command]
    return subprocess.run(arguments, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)


def assert_silent(command: Iterable[str | Path], cwd: Path = ROOT) -> None:
    """Fails, showing what the tool says, unless it exits with 0."""
    result = run(command, cwd)
    if result.returncode != 0:
        pytest.fail(f"{shlex.join(result.args)[:160]}\n{result.stdout}", pytrace=False)
