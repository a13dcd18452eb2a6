"""The files of a replay, written as it goes on."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..can import bulk
from ..can.bulk import Frames
from ..cli.formats import FORMATS
from ..exports.signal_files import SignalFiles
from ..runtime.files import Growing, Outputs, writing
from ..runtime.provenance import Provenance

BUS_LOG, SUMMARY = "bus.log", "summary.json"
"""The summary is the last file to be in its place: where it is, the others are of the same replay."""
FILES = (BUS_LOG, *FORMATS.values(), "report.html", SUMMARY)


class Folder:
    """What grows with the recording. A context manager that lets go of files that are not complete."""

    def __init__(self, outputs: Outputs, formats: Iterable[str], provenance: Provenance) -> None:
        self.outputs = outputs
        self.signals = SignalFiles(formats, outputs.path, provenance)
        self._provenance = provenance
        self._bus_log: _BusLog | None = None

    def log(self, frames: Frames, channel: str) -> None:
        """Further frames, in the order on the bus."""
        if self._bus_log is None:
            self._bus_log = _BusLog(self.outputs.path(BUS_LOG), channel)
        self._bus_log.add(frames)

    def complete(self) -> Provenance:
        """Complete the files; return their provenance. Raise LeverError."""
        self.signals.close()
        if self._bus_log is not None:
            self._bus_log.close()
        return self._provenance.with_outputs(self.outputs.written(BUS_LOG, FORMATS["csv"]))

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, *_: object) -> None:
        self.signals.__exit__()
        if self._bus_log is not None:
            self._bus_log.abandon()


class _BusLog(Growing):
    """bus.log: what the estimator got and what it answered, in candump's format."""

    def __init__(self, path: Path, channel: str) -> None:
        super().__init__(path)
        self._channel = channel

    def add(self, frames: Frames) -> None:
        with writing(self._path):
            self._file.write(bulk.format_lines(frames, self._channel).data)
