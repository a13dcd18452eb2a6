"""trace.csv, a row for each sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..results.trace import Trace, write_csv_header, write_csv_rows
from ..runtime.files import Growing, writing
from .columns import Head


class Csv(Growing):
    """A line for each sample."""

    def __init__(self, path: Path, head: Head) -> None:
        super().__init__(path)
        with writing(path):
            write_csv_header(["time_s", *(column.source for column in head.columns)], self._file)

    def add(self, trace: Trace, _published: NDArray[np.bool_], _recorded: NDArray[np.bool_]) -> None:
        """Further rows."""
        with writing(self._path):
            write_csv_rows(trace, self._file)
