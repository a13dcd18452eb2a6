"""trace.csv, a row for each sample."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..results.trace import Trace, write_csv_header, write_csv_rows
from ..runtime.files import writing
from .head import Head


class Csv:
    """Written a piece at a time; complete after close()."""

    def __init__(self, path: Path, head: Head) -> None:
        self._path = path
        with writing(path):
            self._file = path.open("wb")
            write_csv_header(["time_s", *(column.source for column in head.columns)], self._file)

    def add(self, trace: Trace, _published: NDArray[np.bool_], _recorded: NDArray[np.bool_]) -> None:
        """Further rows."""
        with writing(self._path):
            write_csv_rows(trace, self._file)

    def close(self) -> None:
        """Complete the file."""
        with writing(self._path):
            self._file.close()

    def abandon(self) -> None:
        """Let go of the file."""
        with suppress(OSError):
            self._file.close()
