"""How far a reader of the core has to go: the functions that a sample visits, and the changes of file between them.

    python tests/benchmark/visits.py

runs lever_update() over a recorded second with each function's start and end written down (-finstrument-functions,
not optimised, so none is inlined). A change of file is a call, or a return from it, between functions of two files. Of
modules, a header and its source are one, and math/ is none: to read lesser() nobody goes there. Samples that end a
block are those that judge the evidence.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parent.parent)

from lever_cdkf.cli.tables import Row, print_tables
from lever_cdkf.errors import LeverError
from target.budget.recording import record

PROGRAM = Path(__file__).resolve().parents[2] / "build/tests/lever_visits"
_SAMPLE = "lever_update"
_BLOCK = "evidence_end_block"
"""The function that only a sample visits which ends a block."""
_SETTLED = 1000
"""Samples at the start that are not counted: the filter aligns and the levels of the signals settle."""


@dataclass(frozen=True)
class Visit:
    """What one sample visits."""

    functions: int
    files: int
    """Changes from file to file."""
    modules: int
    """Changes from module to module."""
    ends_block: bool


def visits(program: Path) -> list[Visit]:
    """Run the program over the recording of the lever, and return what each sample visits. Raise LeverError."""
    with tempfile.TemporaryDirectory() as folder:
        samples, trace = Path(folder, "samples"), Path(folder, "visits")
        samples.write_bytes(record("lever").samples.tobytes())
        done = subprocess.run(
            [str(program), str(samples), "1", "model=0"],
            env={**os.environ, "LEVER_VISITS": str(trace)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise LeverError(done.stderr.strip())
        written = np.fromfile(trace, np.uint64)
    address, place = np.unique(written >> np.uint64(1), return_inverse=True)
    names, files = _places(program, address)
    return by_sample(place, (written & np.uint64(1)) == 1, names, files)[_SETTLED:]


def _places(program: Path, addresses: NDArray[np.uint64]) -> tuple[list[str], list[str]]:
    """Return name and file of the functions at the addresses."""
    asked = [f"{address:#x}" for address in addresses]
    lines = subprocess.check_output(["addr2line", "-f", "-e", str(program), *asked], text=True).splitlines()
    return lines[0::2], [line.rpartition(":")[0] for line in lines[1::2]]


def by_sample(place: NDArray[np.int64], ends: NDArray[np.bool_], names: list[str], files: list[str]) -> list[Visit]:
    """Return what each sample visits, of functions by place in `names` and `files`, as they start and end."""
    found: list[Visit] = []
    stack: list[int] = []
    seen: set[int] = set()
    steps: list[tuple[int, int]] = []  # from caller to called, within a sample
    for function, end in zip(place.tolist(), ends.tolist(), strict=True):
        if end:
            stack.pop()
            if names[function] == _SAMPLE:
                found.append(_visit(seen, steps, names, files))
                seen, steps = set(), []
            continue
        if seen:
            steps.append((stack[-1], function))
        if seen or names[function] == _SAMPLE:
            seen.add(function)
        stack.append(function)
    return found


def _visit(seen: set[int], steps: list[tuple[int, int]], names: list[str], files: list[str]) -> Visit:
    modules = [None if "/math/" in file else file[: file.rindex(".")] for file in files]
    passed = [(modules[caller], modules[called]) for caller, called in steps]
    return Visit(
        functions=len(seen),
        files=2 * sum(files[caller] != files[called] for caller, called in steps),
        modules=2 * sum(None not in pair and pair[0] != pair[1] for pair in passed),
        ends_block=any(names[each] == _BLOCK for each in seen),
    )


def table(found: list[Visit]) -> list[Row]:
    """Return the median of both kinds of samples."""
    return [
        {
            "sample": name,
            "samples": len(kind),
            "functions": float(np.median([each.functions for each in kind])),
            "changes of file": float(np.median([each.files for each in kind])),
            "of module": float(np.median([each.modules for each in kind])),
        }
        for name, kind in (
            ("ordinary", [each for each in found if not each.ends_block]),
            ("ends a block", [each for each in found if each.ends_block]),
        )
    ]


def main() -> int:
    """Return the exit status of the command."""
    parser = argparse.ArgumentParser(prog="python tests/benchmark/visits.py", description=__doc__)
    parser.add_argument("--program", type=Path, default=PROGRAM, metavar="FILE", help="default: %(default)s")
    args = parser.parse_args()
    try:
        if not args.program.is_file():
            raise LeverError(f"{args.program} is not there: cmake --build build --target lever_visits")
        print_tables({"what a sample visits in the core, median": table(visits(args.program))})
    except LeverError as error:
        print(f"visits: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
