"""The files with the signals of a run, in the formats that are asked for, written as it goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..cli.formats import FORMATS
from ..results.trace import Trace
from ..runtime.provenance import Provenance
from .columns import Head, columns
from .csv import Csv
from .mcap import Mcap
from .mf4 import Mf4
from .parquet import Parquet

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_ABSOLUTE = 10**15  # [us]: times from 2001 on are of a calendar


class _Writer(Protocol):
    def add(self, trace: Trace, published: NDArray[np.bool_], recorded: NDArray[np.bool_], /) -> None: ...
    def close(self) -> None: ...
    def abandon(self) -> None: ...


_WRITERS: dict[str, Callable[[Path, Head], _Writer]] = {"csv": Csv, "mf4": Mf4, "mcap": Mcap, "parquet": Parquet}


def calendar(time_us: int) -> datetime | None:
    """Return a recorded time [us since 1970] as a date; None where it is a time since something else."""
    return _EPOCH + timedelta(microseconds=time_us) if time_us >= _ABSOLUTE else None


class SignalFiles:
    """A context manager; complete after close(), else without what is incomplete."""

    def __init__(self, formats: Iterable[str], path: Callable[[str], Path], provenance: Provenance) -> None:
        """`path` says where to write a file of that name."""
        self._formats, self._path, self._provenance = tuple(formats), path, provenance
        self._writers: list[_Writer] = []
        self.started = False

    def start(self, names: Iterable[str], start_us: int, estimator: dict[str, Any]) -> None:
        """Begin the files: columns of the trace, recorded time of time_s = 0, the estimator's choices and settings."""
        self.started = True
        start = calendar(start_us)
        more = {"estimator": estimator} | ({"start": start.isoformat()} if start else {})
        described, properties = columns(names, estimator["model"]), self._provenance.properties(**more)
        head = Head(described, start_us, self._provenance.moment(), properties)
        for name in self._formats:
            self._writers.append(_WRITERS[name](self._path(FORMATS[name]), head))

    def add(self, trace: Trace, published: NDArray[np.bool_], recorded: NDArray[np.bool_]) -> None:
        """Further samples; `published` and `recorded` are those with new estimates of the run and of the recording."""
        for writer in self._writers:
            writer.add(trace, published, recorded)

    def close(self) -> None:
        """Complete the files. Raise LeverError."""
        while self._writers:
            self._writers[-1].close()
            self._writers.pop()

    def __enter__(self) -> SignalFiles:
        return self

    def __exit__(self, *_: object) -> None:
        for writer in self._writers:
            writer.abandon()
