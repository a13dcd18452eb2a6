"""trace.parquet: the columns of trace.csv, for pandas, polars, DuckDB and the like.

Unit and meaning of each are metadata of its field, provenance is metadata of the file. What is not known is null; mode
and faults are words.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..numeric.arrays import FloatArray
from ..results.trace import WHOLE, Trace
from ..runtime.extras import require
from ..runtime.files import Growing, writing
from .columns import TEXT, Head, as_words


class Parquet(Growing):
    """A row for each sample."""

    def __init__(self, path: Path, head: Head) -> None:
        require("files", "pyarrow")
        import pyarrow
        from pyarrow import parquet

        super().__init__(path)
        described = [("time_s", "s", "Since the first sample.")]
        described += [(column.source, column.unit, column.comment) for column in head.columns]
        fields = [
            pyarrow.field(name, _kind(name), metadata={"unit": unit, "comment": comment})
            for name, unit, comment in described
        ]
        self._schema = pyarrow.schema(fields, metadata=dict(head.properties))
        with writing(path):
            self._writer: Any = parquet.ParquetWriter(self._file, self._schema)

    def add(self, trace: Trace, _published: NDArray[np.bool_], _recorded: NDArray[np.bool_]) -> None:
        """Further samples."""
        import pyarrow

        arrays = [_array(name, values, self._schema.field(name).type) for name, values in trace.items()]
        with writing(self._path):
            self._writer.write_table(pyarrow.table(arrays, schema=self._schema))

    def _finish(self) -> None:
        """Write the index."""
        self._writer.close()

    def abandon(self) -> None:
        """Let go of it."""
        super().abandon()
        with suppress(Exception):
            self._writer.close()


def _kind(column: str) -> Any:
    import pyarrow

    if column in TEXT:
        return pyarrow.string()
    return pyarrow.int64() if column in WHOLE else pyarrow.float64()


def _array(column: str, values: FloatArray, kind: Any) -> Any:
    """NaN becomes null."""
    import pyarrow

    if column in TEXT:
        return pyarrow.array(as_words(column, values), kind)
    return pyarrow.array(values, pyarrow.float64(), from_pandas=True).cast(kind)
