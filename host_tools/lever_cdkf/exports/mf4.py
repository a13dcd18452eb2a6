"""signals.mf4: the signals with units, comments and sources, for asammdf, PlotJuggler and other readers of ASAM MDF 4.

A group for what comes with every sample, one for what the estimator sends at its divided rate, at the samples at which
it did, and others for the truth of a simulation and for recorded estimates. Values in single precision, which holds
every step of the bus exactly enough; NaN is what was not known. Mode and faults are numbers with their words.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from ..can import codec
from ..numeric.arrays import FloatArray
from ..results.trace import Trace
from ..runtime.extras import require
from ..runtime.files import writing
from .columns import RECORDED, TEXT, TRUTH, Column, Head, together, words

_NOT_KNOWN = 0xFFFFFFFF
"""In the place of NaN."""


class Mf4:
    """Written a piece at a time; complete after close()."""

    def __init__(self, path: Path, head: Head) -> None:
        require("mf4")
        from asammdf import MDF

        self._path, self._head = path, head
        self._groups = together(head.columns, _group)
        self._indices: dict[str, int] = {}
        self._numbers: dict[str, set[int]] = {}
        with writing(path):
            self._file: Any = MDF(version="4.10", temporary_folder=str(path.parent))
        header = self._file.header
        header.start_time = datetime.fromtimestamp(0, tz=timezone.utc)
        header.abs_time = head.start_us * 1000  # [ns]
        header.comment = _xml("HDcomment", head.properties)
        self._file.file_history = [_history(head)]

    def add(self, trace: Trace, published: NDArray[np.bool_], recorded: NDArray[np.bool_]) -> None:
        """Further samples; `published` and `recorded` are those with new estimates of the run and the recording."""
        for name, described in self._groups.items():
            rows = described[0].fresh(published, recorded)
            if rows.any():
                self._append(name, described, trace, rows)

    def _append(self, name: str, described: list[Column], trace: Trace, rows: NDArray[np.bool_]) -> None:
        from asammdf import Signal

        time = trace["time_s"][rows]
        values = [self._values(column.source, trace[column.source][rows]) for column in described]
        with writing(self._path), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # asammdf's own, of numpy and pandas
            if name in self._indices:
                self._file.extend(self._indices[name], [(time, None), *((column, None) for column in values)])
            else:
                group = [
                    Signal(
                        each, time, name=column.name, unit=column.unit, comment=column.comment, source=_source(column)
                    )
                    for each, column in zip(values, described, strict=True)
                ]
                self._indices[name] = self._file.append(group, acq_name=name, common_timebase=True)

    def _values(self, column: str, values: FloatArray) -> NDArray[Any]:
        if column not in TEXT:
            return values.astype(np.float32)
        numbers = np.nan_to_num(values, nan=_NOT_KNOWN).astype(np.uint32)
        self._numbers.setdefault(column, set()).update(np.unique(numbers).tolist())
        return numbers

    def close(self) -> None:
        """Write the file."""
        for name, index in self._indices.items():
            channels = self._file.groups[index].channels[1:]  # the first is time
            for channel, column in zip(channels, self._groups[name], strict=True):
                if column.source in TEXT:
                    channel.conversion = _conversion(column.source, self._numbers[column.source])
        with writing(self._path), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._file.save(self._path, overwrite=True, add_history_block=False)
            self._file.close()

    def abandon(self) -> None:
        """Let go of its files."""
        with suppress(Exception):
            self._file.close()


def _group(column: Column) -> str:
    if column.kind == TRUTH:
        return "truth"
    if not column.held:
        return "samples"
    return "recorded estimates" if column.kind == RECORDED else "estimates"


def _source(column: Column) -> Any:
    from asammdf.blocks.source_utils import Source

    if not column.message:
        return Source("truth", "simulation", "", Source.SOURCE_TOOL, Source.BUS_TYPE_NONE)
    comment = codec.message(column.message).comment or ""
    return Source(column.message, "lever.dbc", comment, Source.SOURCE_BUS, Source.BUS_TYPE_CAN)


def _conversion(column: str, numbers: set[int]) -> Any:
    """Return the words of the numbers that there are."""
    from asammdf.blocks.conversion_utils import from_dict

    table: dict[str, Any] = {"default_addr": ""}
    for index, number in enumerate(sorted(numbers)):
        table[f"val_{index}"] = number
        table[f"text_{index}"] = "not known" if number == _NOT_KNOWN else words(column, number) or "none"
    return from_dict(table)


def _history(head: Head) -> Any:
    """Who made the file, and when."""
    from asammdf.blocks.v4_blocks import FileHistory

    history = FileHistory()
    history.time_stamp = head.created
    tool = {"tool_id": "lever", "tool_vendor": "Lever CDKF", "tool_version": head.properties["version"]}
    fields = "".join(f"<{name}>{escape(text)}</{name}>" for name, text in tool.items())
    history.comment = f"<FHcomment><TX>{escape(head.properties['command'])}</TX>{fields}</FHcomment>"
    return history


def _xml(tag: str, properties: Mapping[str, str]) -> str:
    each = "".join(f"<e name={quoteattr(name)}>{escape(text)}</e>" for name, text in properties.items())
    return f"<{tag}><TX>{escape(properties['software'])}</TX><common_properties>{each}</common_properties></{tag}>"
