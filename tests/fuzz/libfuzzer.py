"""Building and running the fuzz targets of this folder: each `<name>.c`, with libFuzzer, AddressSanitizer and UBSan."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
FIRMWARE = FOLDER.parents[1] / "firmware"
SOURCES = {"slcan": ("port/slcan/slcan.c",)}
"""What each target runs, of firmware/."""
FLAGS = ("-std=c99", "-g", "-O1", "-fno-omit-frame-pointer", "-fsanitize=fuzzer,address,undefined")
COMPILERS = "clang-19|clang"
FAST_UNITS = "-timeout=5"
"""An input that takes longer than so many seconds is a finding, too."""


class FuzzError(Exception):
    """A target that cannot be built."""


@dataclass(frozen=True)
class Result:
    """How a run ended; the input that was found is in the text."""

    found: bool
    text: str


def build(name: str, folder: Path, sources: Sequence[Path] = ()) -> Path:
    """The fuzzer of a target, in `folder`; `sources` take the place of the firmware's. Raises FuzzError."""
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / name
    compiler = next((path for each in COMPILERS.split("|") if (path := shutil.which(each))), None)
    if compiler is None:
        raise FuzzError("no clang here: apt install clang-19 libclang-rt-19-dev")
    files = [FOLDER / f"{name}.c", *(sources or [FIRMWARE / source for source in SOURCES[name]])]
    command = [compiler, *FLAGS, "-I", str(FIRMWARE), *map(str, files), "-o", str(program)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise FuzzError(f"{compiler} cannot build {name} (its runtime is in libclang-rt-19-dev):\n{result.stderr}")
    return program


def run(program: Path, corpus: Path, options: Sequence[str]) -> Result:
    """Fuzzes with, and adds to, the inputs in `corpus`; findings are written beside the program."""
    corpus.mkdir(parents=True, exist_ok=True)
    dictionary = FOLDER / f"{program.name}.dict"
    found = f"-artifact_prefix={program}-"
    command = [str(program), FAST_UNITS, f"-dict={dictionary}", found, "-print_final_stats=1", *options, str(corpus)]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    return Result(result.returncode != 0, result.stdout)
