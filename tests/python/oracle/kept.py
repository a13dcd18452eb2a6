"""What the float64 oracle says in a case, kept in the build tree: half a minute of Python that the tests need and the
mutants of the core, too."""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from lever_cdkf.numeric.arrays import Array

ROOT = Path(__file__).resolve().parents[3]
FOLDER = Path(os.environ.get("LEVER_BUILD_DIR", ROOT / "build")) / "tests/oracle"
OF = (
    "tests/oracle/*.py",
    "host_tools/lever_cdkf/models/*.py",
    "firmware/lever_settings.def",
    "tests/python/oracle/test_oracle_against_firmware.py",
)


@functools.cache
def digest() -> str:
    """Return the digest of all that the values depend on."""
    files = sorted(file for pattern in OF for file in ROOT.glob(pattern))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:16]


def values_of(name: str, calculate: Callable[[], dict[str, Array]]) -> dict[str, Array]:
    """Return those of a case, calculated unless they are there already; under a mutant always."""
    file = FOLDER / digest() / f"{name}.npz"
    if "MUTANT_OF" in os.environ:
        return calculate()
    if not file.exists():
        values = calculate()
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(f".{os.getpid()}.npz")
        np.savez(part, allow_pickle=False, **values)
        part.rename(file)  # whole, whoever else writes it
    with np.load(file) as kept:
        return dict(kept)
