"""Run a proof, unless it has passed before with the same inputs.

    python tests/setup/stamped.py NAME BUILD INPUT ... -- COMMAND ...

A result depends on the files at and below each INPUT (relative to the source tree), those of COMMON, the command, the
versions of compilers and analysers, the settings of the build, and the variables LEVER_*. Their digest is part of the
name of the stamp, which a pass leaves in the folder LEVER_STAMPS, or in BUILD/stamps without that variable. A proof
that fails or is skipped leaves none. With LEVER_STAMPS empty every proof runs.

Exit status: that of the command, or 0 when it has passed before.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMON = (
    *("CMakeLists.txt", "CMakePresets.json", "pyproject.toml"),
    *("tests/CMakeLists.txt", "tests/conftest.py", "tests/setup"),
)
"""Inputs of every proof."""
TOOLS = (
    "cc", "gcc", "clang", "clang-19", "arm-none-eabi-gcc", "qemu-system-arm", "qemu-mips-static", "mips-linux-gnu-gcc",
    "frama-c", "valgrind",
)  # fmt: skip
APART = ("LEVER_BUILD_DIR", "LEVER_REQUIRE_ALL", "LEVER_STAMPS")
"""Variables on which a pass does not depend."""


def main() -> int:
    end = sys.argv.index("--")
    command = sys.argv[end + 1 :]
    parser = argparse.ArgumentParser(prog="stamped", description=__doc__.splitlines()[0])
    parser.add_argument("name")
    parser.add_argument("build", type=Path)
    parser.add_argument("inputs", nargs="+")
    args = parser.parse_args(sys.argv[1:end])
    folder = os.environ.get("LEVER_STAMPS", str(args.build / "stamps"))
    stamp = Path(folder, f"{args.name}-{digest(args.build, args.inputs, command)}") if folder else None
    if stamp is not None and stamp.exists():
        print(f"{args.name}: passed before with the same inputs ({stamp})")
        return 0
    status = subprocess.run(command, check=False).returncode
    if status == 0 and stamp is not None:
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.touch()
    return status


def digest(build: Path, inputs: list[str], command: list[str]) -> str:
    """Return the digest of all that the result depends on. Raise FileNotFoundError for an input that is not there."""
    total = hashlib.sha256()
    for path in files([*COMMON, *inputs]):
        total.update(f"{path.relative_to(ROOT)} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    for line in (*surroundings(build), *command):
        total.update(line.replace(str(build), "BUILD").replace(str(ROOT), "ROOT").encode() + b"\n")
    return total.hexdigest()[:32]


def files(inputs: list[str]) -> list[Path]:
    """Return the files at and below the paths, without what Python compiles."""
    found: set[Path] = set()
    for path in (ROOT / name for name in inputs):
        if not path.exists():
            raise FileNotFoundError(f"{path}: no such input; correct it in tests/CMakeLists.txt")
        below = path.rglob("*") if path.is_dir() else [path]
        found.update(file for file in below if file.is_file() and "__pycache__" not in file.parts)
    return sorted(found)


def surroundings(build: Path) -> Iterator[str]:
    """Yield the versions of the tools, the settings of the build and the variables LEVER_*."""
    yield sys.version
    for tool in TOOLS:
        if shutil.which(tool):
            shown = subprocess.run([tool, "--version"], capture_output=True, text=True, check=False).stdout
            yield f"{tool}: {shown.splitlines()[:1]}"
    for line in (build / "CMakeCache.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith(("LEVER_", "CMAKE_C_", "CMAKE_BUILD_TYPE")) and ":INTERNAL=" not in line:
            yield line
    yield from (
        f"{name}={value}"
        for name, value in sorted(os.environ.items())
        if name.startswith("LEVER_") and name not in APART
    )


if __name__ == "__main__":
    sys.exit(main())
