"""The files of a replay, written as it goes on."""

from __future__ import annotations

from pathlib import Path

from ..can import bulk
from ..can.bulk import Frames
from ..files import writing
from ..results.trace import Trace, write_csv_header, write_csv_rows

SUMMARY = "summary.json"
"""The last file to be in its place: where it is, the others are of the same replay."""
FILES = ("bus.log", "trace.csv", "signals.mf4", "report.html", SUMMARY)


class BusLog:
    """bus.log: what the estimator got and what it answered, in candump's format."""

    def __init__(self, path: Path, channel: str) -> None:
        self._path, self._channel = path, channel
        with writing(path):
            self._file = path.open("wb")

    def add(self, frames: Frames) -> None:
        """Further frames, in the order on the bus."""
        with writing(self._path):
            self._file.write(bulk.format_lines(frames, self._channel).data)

    def close(self) -> None:
        with writing(self._path):
            self._file.close()


class TraceCsv:
    """trace.csv, a row for each sample."""

    def __init__(self, path: Path) -> None:
        self._path, self._started = path, False
        with writing(path):
            self._file = path.open("wb")

    def add(self, trace: Trace) -> None:
        """Further rows."""
        with writing(self._path):
            if not self._started:
                write_csv_header(trace, self._file)
            write_csv_rows(trace, self._file)
        self._started = True

    def close(self) -> None:
        with writing(self._path):
            self._file.close()
