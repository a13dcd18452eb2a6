"""Building and running the fuzz targets of this folder: each `<name>.c`, with libFuzzer, AddressSanitizer and UBSan.

A target begins with the inputs of `<name>.seeds`, each under a line `=== what it is`; those of HEXADECIMAL are that.
Words that are worth trying are in `<name>.dict`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
CORE = tuple(
    str(source.relative_to(ROOT))
    for folder in ("math", "model", "filter", "can", "app", "bounce")
    for source in sorted((ROOT / "firmware" / folder).glob("*.c"))
)
SOURCES = {
    "app": CORE,
    "slcan": ("firmware/port/slcan/slcan.c",),
    "candump": ("host_tools/lever_cdkf/firmware/c/candump.c",),
    "settings": ("firmware/port/linux/settings.c", "firmware/app/settings.c"),
    "aircraft": ("firmware/port/linux/aircraft.c", "firmware/port/linux/settings.c", "firmware/app/settings.c"),
}
"""What each target runs."""
HEXADECIMAL = ("app",)
FLAGS = (
    *("-std=c99", "-ffp-contract=off", "-fno-math-errno", "-g", "-O1", "-fno-omit-frame-pointer"),
    *("-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all", "-DLEVER_ASSERTIONS"),
    *(f"-I{ROOT / folder}" for folder in ("firmware", "host_tools/lever_cdkf/firmware/c", "tests/fuzz")),
)
COMPILERS = "clang-19|clang"
FAST_UNITS = "-timeout=60"
"""An input that takes longer than so many seconds is a finding, too."""


class FuzzError(Exception):
    """A target that cannot be built."""


@dataclass(frozen=True)
class Result:
    """How a run ended; the input that was found is in the text."""

    found: bool
    text: str

    def count(self, name: str) -> int:
        """Return what it says of `stat::name`; 0 where it says nothing."""
        said = re.search(rf"stat::{name}: +(\d+)", self.text)
        return int(said[1]) if said else 0


def build(name: str, folder: Path, replaced: Sequence[tuple[str, Path]] = ()) -> Path:
    """Return the fuzzer of a target, in `folder`; `replaced`: sources in whose place others are taken, beside the
    objects that are there from the build before. Raise FuzzError."""
    objects = folder / f"{name}.objects"
    objects.mkdir(parents=True, exist_ok=True)
    compiler = next((path for each in COMPILERS.split("|") if (path := shutil.which(each))), None)
    if compiler is None:
        raise FuzzError("no clang here: apt install clang-19 libclang-rt-19-dev")
    others = dict(replaced)
    kept = [ROOT / source for source in (f"tests/fuzz/{name}.c", *SOURCES[name]) if source not in others]
    steps = {objects / f"{source.parent.name}_{source.stem}.o": source for source in kept}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in [
            pool.submit(_run, [compiler, *FLAGS, "-c", str(source), "-o", str(into)])
            for into, source in steps.items()
            if not (replaced and into.exists())
        ]:
            done.result()
    program = folder / name
    _run([compiler, *FLAGS, *map(str, others.values()), *map(str, steps), "-lm", "-o", str(program)])
    return program


def _run(command: Sequence[str]) -> None:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        words = f"{' '.join(command)[:200]} fails (its runtime is in libclang-rt-19-dev):\n{result.stderr}"
        raise FuzzError(words)


def seeds(name: str) -> list[bytes]:
    """Return the inputs that a target begins with."""
    file = FOLDER / f"{name}.seeds"
    blocks = re.split(r"^=== .*\n", file.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:] if file.exists() else []
    return [bytes.fromhex(block) if name in HEXADECIMAL else block.encode() for block in blocks]


def run(program: Path, corpus: Path, options: Sequence[str]) -> Result:
    """Fuzzes with, and adds to, the inputs in `corpus`; findings are written beside the program."""
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds(program.name)):
        (corpus / f"seed{number}").write_bytes(seed)
    dictionary = FOLDER / f"{program.name}.dict"
    words = [f"-dict={dictionary}"] if dictionary.exists() else []
    found = f"-artifact_prefix={program}-"
    command = [str(program), FAST_UNITS, *words, found, "-print_final_stats=1", *options, str(corpus)]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    return Result(result.returncode != 0, result.stdout)
