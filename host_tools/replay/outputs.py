"""The files of a replay, written as it goes on into a hidden folder; none is in its place before all are whole."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from ..can import bulk
from ..can.bulk import Frames
from ..errors import LeverError
from ..files import make_folder
from ..results.trace import Trace, write_csv_header, write_csv_rows

SUMMARY = "summary.json"
"""The last file to be in its place: where it is, the others are of the same replay."""
FILES = ("bus.log", "trace.csv", "signals.mf4", "report.html", SUMMARY)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raises LeverError, which names `path`, for an OSError inside."""
    try:
        yield
    except OSError as error:
        raise LeverError(f"cannot write {path}: {error.strerror or error}") from None


class Outputs:
    """A context manager; without finish() it leaves nothing behind."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._unfinished = folder / f".replay.{os.getpid()}.tmp"

    def __enter__(self) -> Outputs:
        make_folder(self._folder)
        with writing(self._folder):
            self._unfinished.mkdir()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        shutil.rmtree(self._unfinished, ignore_errors=True)

    def path(self, name: str) -> Path:
        """Where to write the file `name`."""
        return self._unfinished / name

    def finish(self) -> None:
        """Puts the files into their place, and takes away those of an earlier replay that this one has not. Raises
        LeverError."""
        with writing(self._folder):
            (self._folder / SUMMARY).unlink(missing_ok=True)
            for name in FILES:
                if self.path(name).exists():
                    os.replace(self.path(name), self._folder / name)
                else:
                    (self._folder / name).unlink(missing_ok=True)


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
