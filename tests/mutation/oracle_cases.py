"""Writes what the float64 oracle expects of the firmware in each case of tests/python/oracle, for oracle.c.

    python oracle_cases.py FOLDER

A file holds, as oracle.c reads it: the configuration; the samples; for some of them, what each quantity of the estimate
must be, and how far off it may be.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from lever_cdkf.firmware.library import ffi
from lever_cdkf.firmware.samples import sample_array

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from oracle.scale import PARAMETERS
from python.oracle import test_oracle_against_firmware as reference

WITHIN = {"theta": reference.THETA_WITHIN, "theta_dot": reference.THETA_DOT_WITHIN}


def limits(case: reference.Case, expected: reference.Expected) -> Iterator[tuple[reference.Array, reference.Array]]:
    """Yield value and tolerance of each quantity, in the order of oracle.c."""
    values = expected.values
    for name in (*reference.STATES, *PARAMETERS[case.model], *reference.DERIVED):
        sigma = values[f"{name}_sigma"]
        yield values[name], sigma * WITHIN.get(name, reference.PARAMETERS_WITHIN)
        yield sigma, sigma * reference.SIGMA_WITHIN
    yield values["nis"], reference.NIS_WITHIN * (1.0 + values["nis"])


def write(case: reference.Case, path: Path) -> None:
    expected = reference.expected_of(case)
    samples = sample_array(expected.samples, expected.config.settings["sample_period"])
    columns = [np.column_stack(each) for each in limits(case, expected)]
    rows = np.stack(columns, axis=1)
    with path.open("wb") as file:
        file.write(bytes(ffi.buffer(expected.config.pointer)))
        np.array((len(samples), expected.first, reference.EVERY, len(rows)), np.uint32).tofile(file)
        samples.tofile(file)
        rows.astype(float).tofile(file)


def main() -> int:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.case"):
        old.unlink()
    for case in reference.CASES:
        write(case, folder / f"{case}.case")
    return 0


if __name__ == "__main__":
    sys.exit(main())
