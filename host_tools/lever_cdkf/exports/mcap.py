"""signals.mcap: the signals as messages for Foxglove and other readers of MCAP.

A channel for each message of lever.dbc, /lever/NAME, one for the truth of a simulation, /lever/truth, and
/lever/recorded/NAME for recorded estimates. Messages are JSON with a schema that says unit and meaning of each field; a
field that is not known is left out, mode and faults are words. Log time is that of the sample.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..can import codec
from ..results.trace import Trace
from ..runtime.extras import require
from ..runtime.files import Growing, writing
from .columns import RECORDED, TEXT, Column, Head, as_words, together

_DIGITS = 9


class Mcap(Growing):
    """A message for each sample of each topic."""

    def __init__(self, path: Path, head: Head) -> None:
        require("files", "mcap")
        from mcap.writer import Writer

        super().__init__(path)
        self._head = head
        with writing(path):
            self._writer: Any = Writer(self._file)
            self._writer.start(profile="", library=f"{head.properties['software']} {head.properties['version']}")
            self._writer.add_metadata("provenance", dict(head.properties))
        self._topics = together(head.columns, _topic)
        self._channels: dict[str, int] = {}

    def _channel(self, name: str) -> int:
        """Return its number; a channel is there from its first message on."""
        if name not in self._channels:
            content = json.dumps(_schema(name, self._topics[name]), ensure_ascii=False).encode()
            schema = self._writer.register_schema(f"lever/{name}", "jsonschema", content)
            self._channels[name] = self._writer.register_channel(f"/lever/{name}", "json", schema)
        return self._channels[name]

    def add(self, trace: Trace, published: NDArray[np.bool_], recorded: NDArray[np.bool_]) -> None:
        """Further samples; `published` and `recorded` are those with new estimates of the run and the recording."""
        time = self._head.start_us * 1000 + np.round(trace["time_s"] * 1e9).astype(np.int64)
        messages: list[tuple[int, str, bytes]] = []
        for name, described in self._topics.items():
            rows = np.flatnonzero(described[0].fresh(published, recorded))
            texts = _objects(trace, rows, described)
            messages += [(at, name, text) for at, text in zip(time[rows].tolist(), texts, strict=True) if text]
        messages.sort(key=lambda each: each[0])
        with writing(self._path):
            for at, name, text in messages:
                self._writer.add_message(self._channel(name), at, text, at)

    def _finish(self) -> None:
        """Write the index."""
        self._writer.finish()


def _objects(trace: Trace, rows: NDArray[np.intp], described: list[Column]) -> Iterator[bytes]:
    """JSON of each row; nothing where no field is known."""
    fields = []
    for column in described:
        values = trace[column.source][rows]
        key = json.dumps(column.field)
        if column.source in TEXT:
            fields.append(
                [None if word is None else f"{key}:{json.dumps(word)}" for word in as_words(column.source, values)]
            )
        else:
            finite = np.isfinite(values).tolist()
            fields.append(
                [f"{key}:{value:.{_DIGITS}g}" if there else None for value, there in zip(values, finite, strict=True)]
            )
    for row in zip(*fields, strict=True):
        text = ",".join(field for field in row if field is not None)
        yield f"{{{text}}}".encode() if text else b""


def _topic(column: Column) -> str:
    return f"recorded/{column.message}" if column.kind == RECORDED else column.message or column.kind


def _schema(name: str, described: list[Column]) -> dict[str, Any]:
    """Return a JSON schema."""
    properties = {}
    for column in described:
        unit = f" [{column.unit}]" if column.unit else ""
        kind = "string" if column.source in TEXT else "number"
        properties[column.field] = {"type": kind, "description": f"{column.comment}{unit}"}
    message = described[0].message
    about = codec.message(message).comment or "" if message else "Of a simulation."
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        "description": about,
        "type": "object",
        "properties": properties,
    }
