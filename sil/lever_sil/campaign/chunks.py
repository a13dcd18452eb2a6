"""Chunks of a campaign: which flights each has, the Parquet file of each, and which are there already.

A chunk is a range of flights. Its file is named by the fingerprint of the campaign and that range, and is put into
place by a rename when it is whole. So listing the files says what is done, whoever was killed meanwhile.
"""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.files import native_file, shared_library, whole

from . import figures
from .entrants import ENTRANTS
from .runs import rows
from .spec import FILE as SPEC
from .spec import Spec

if TYPE_CHECKING:
    import pyarrow as pa

WORK = 1.0
"""Processor time that a chunk is meant to take [s]: far above the 1 ms that Dask costs a task, and little to lose."""

SUMMARY = "summary.json"
_REMEDY = "give another folder"
_NAME = re.compile(r"([0-9a-f]{16})-(\d{10})-(\d{10})\.parquet")
_LIBRARIES = ("lever_cdkf", "lever_loop", "lever_bulk")


@dataclass(frozen=True, order=True)
class Chunk:
    """Flights from `first` to before `end`."""

    first: int
    end: int

    def name(self, fingerprint: str) -> str:
        """Return its file."""
        return f"{fingerprint}-{self.first:010d}-{self.end - 1:010d}.parquet"


class Plan:
    """How a campaign is cut into chunks: the same on every machine, whatever the number of workers."""

    def __init__(self, spec: Spec) -> None:
        first = spec.first
        self.spec = spec
        self.fingerprint = fingerprint(spec)
        self.minutes = first.duration / 60.0
        self.model = first.config.choices["model"]
        entrants = [ENTRANTS[name] for name in spec.estimators]
        cost = self.minutes * sum(entrant.cost for entrant in entrants)
        self.size = spec.chunk or max(1, math.ceil(WORK / cost))
        self.count = math.ceil(spec.flights / self.size)

    def chunk(self, number: int) -> Chunk:
        """Chunk `number` of `count`."""
        return Chunk(number * self.size, min((number + 1) * self.size, self.spec.flights))

    def runs(self, chunk: Chunk) -> int:
        """Return rows of a chunk."""
        return (chunk.end - chunk.first) * len(self.spec.estimators)

    def done(self, folder: Path) -> set[int]:
        """Return numbers of the chunks whose files are there and whole.

        Raise LeverError when files of another campaign, or another command, are there.
        """
        numbers = set()
        present = [name for name in (SPEC, SUMMARY) if (folder / name).exists()]
        if present and not self.spec.is_kept_in(folder):
            raise LeverError(f"{folder} holds another campaign, or another command's run ({present[0]}): {_REMEDY}")
        for file in _listed(folder):
            match = _NAME.fullmatch(file.name)
            if match is None or match[1] != self.fingerprint:
                raise LeverError(f"{folder} holds another campaign, or one of another build ({file.name}): {_REMEDY}")
            number, rest = divmod(int(match[2]), self.size)
            if rest or file.name != self.chunk(number).name(self.fingerprint):
                raise LeverError(f"{folder} holds chunks of another size ({file.name}): {_REMEDY}")
            if _rows_in(file) == self.runs(self.chunk(number)):
                numbers.add(number)
        return numbers


def _listed(folder: Path) -> list[Path]:
    return sorted(file for file in folder.glob("*.parquet")) if folder.is_dir() else []


def _rows_in(file: Path) -> int | None:
    """By its footer; None where that cannot be read, as after a power failure."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return int(pq.read_metadata(file).num_rows)
    except (OSError, pa.ArrowInvalid):
        return None


@cache
def _code() -> bytes:
    digest = hashlib.sha256()
    for library in _LIBRARIES:
        digest.update(native_file(shared_library(library)).read_bytes())
    return digest.digest()


def fingerprint(spec: Spec) -> str:
    """Return what the names of a campaign's files begin with.

    It is the fingerprint of the spec and of the shared libraries that make its rows.
    """
    return hashlib.sha256(spec.hashed.encode() + _code()).hexdigest()[:16]


def schema(plan: Plan) -> pa.Schema:
    """Return the columns of a chunk's file; README.md describes them."""
    import pyarrow as pa

    varied = [
        pa.field(axis.key, pa.float64() if axis.is_number else pa.string(), metadata={"unit": axis.unit or "1"})
        for axis in plan.spec.vary
    ]
    return pa.schema(
        [
            pa.field("run", pa.int64(), nullable=False),
            pa.field("point", pa.int64(), nullable=False),
            pa.field("seed", pa.int64(), nullable=False),
            pa.field("estimator", pa.string(), nullable=False),
            *varied,
            *(pa.field(name, pa.float64()) for name in figures.names(plan.model)),
            pa.field("error", pa.string()),
        ],
        metadata={"lever_campaign": plan.fingerprint, "title": plan.spec.title},
    )


def make(plan: Plan, chunk: Chunk, folder: Path) -> int:
    """Run a chunk and write its file; return how many rows it has. Raise LeverError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    chunk_rows = [{"error": None, **row} for row in rows(plan.spec, range(chunk.first, chunk.end))]
    with whole(folder / chunk.name(plan.fingerprint)) as target:
        pq.write_table(pa.Table.from_pylist(chunk_rows, schema(plan)), target, compression="zstd")
    return len(chunk_rows)
