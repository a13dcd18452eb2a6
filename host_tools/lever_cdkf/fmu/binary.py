"""The shared library of an FMU, by this machine's C compiler."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from ..errors import LeverError
from ..runtime.extras import require

_FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno")
_EXPORT = '-DFMI3_Export=__attribute__((visibility("default")))'
_MACHINES = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
_LINES_SHOWN = 3


def platform_tuple() -> str:
    """Return the folder of binaries for this machine, such as x86_64-linux."""
    machine = platform.machine().lower()
    system = {"darwin": "darwin", "win32": "windows"}.get(sys.platform, "linux")
    return f"{_MACHINES.get(machine, machine)}-{system}"


def headers() -> Path:
    """Return the folder with the headers of FMI 3.0, which FMPy brings. Raise LeverError without it."""
    require("fmu")
    spec = find_spec("fmpy")
    assert spec is not None
    assert spec.submodule_search_locations
    return Path(spec.submodule_search_locations[0]) / "c-code"


def compiler() -> list[str]:
    """Return the C compiler as a command: CC, or what is found. Raise LeverError."""
    named = shlex.split(os.environ.get("CC", ""))
    if named:
        if shutil.which(named[0]) is None:
            raise LeverError(f"CC = {os.environ['CC']}: there is no such compiler: apt install gcc, or set another CC")
        return named
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    raise LeverError("an FMU needs a C compiler, and there is none: apt install gcc, or set CC")


def compile_library(folder: Path, sources: Sequence[str], library: Path) -> None:
    """Compile `sources` into `library`; raise LeverError.

    The sources are paths below `folder`, which is where their headers are from, too.
    """
    library.parent.mkdir(parents=True)
    include = ("-I", str(folder), "-isystem", str(headers()))
    command = [*compiler(), *_FLAGS, _EXPORT, *include, *sources, "-o", str(library), "-lm"]
    try:
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except OSError as error:
        raise LeverError(f"{command[0]}: cannot be run: {error.strerror}") from None
    if result.returncode != 0:
        said = " ".join(line for line in result.stderr.splitlines() if "error" in line) or result.stderr
        raise LeverError(f"{command[0]} cannot compile the FMU: {' '.join(said.splitlines()[:_LINES_SHOWN])[:500]}")
