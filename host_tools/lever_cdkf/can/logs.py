"""Recorded logs as chunks of frames: every format that python-can reads, and candump's at the speed of C.

    recording = Recording(["flight.log", "flight.log.1"])
    for frames in recording.chunks():
        frames["time_us"], frames["id"], frames["data"], recording.buses.names()[frames["bus"][0]]

Chunks are arrays of bulk.FRAME, in recorded order, a few MB at most whatever the size of the log. Several logs are
taken one after another in the order of their first frames. `-` is standard input, in candump's format. Lines that
are no frame are counted, as is a log that breaks off; one that has no frame at all is a LogError.
"""

from __future__ import annotations

import gc
import gzip
import os
import stat
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import LeverError
from ..runtime.extras import require
from ..runtime.quiet_asammdf import quiet_asammdf
from . import identifiers
from .bulk import ERROR, EXTENDED, FD, FRAME, LONGEST_LINE, REMOTE, Buses, Frames, parse

BLOCK = 1 << 22
"""Bytes of text that are read at once."""
_MESSAGES = 16384  # that are read at once through python-can
_GZIP = b"\x1f\x8b"
_CANDUMP = (".log", ".candump", ".txt", "")
_OTHERS = (".asc", ".blf", ".csv", ".db", ".mf4", ".trc")
_COMPRESSED = ".gz"


class LogError(LeverError):
    """A log that cannot be read; one line with file and reason."""


def incomplete(ends_early: Sequence[str]) -> str:
    """Return the sentence that a log is cut off, and where; empty when it is whole."""
    return f"The log is incomplete: {'; '.join(ends_early)}." if ends_early else ""


class Recording:
    """One or several logs, of which the first frames are read at once.

    Parameters
    ----------
    paths
        Of the logs, in any order: they are sorted by their first frames.
    translated
        Whether frames have the identifiers of lever.dbc, whatever they were on the bus.

    Raises
    ------
    LogError
        A log cannot be read, holds no frame, or is given twice.
    """

    def __init__(self, paths: Iterable[str | os.PathLike[str]], *, translated: bool = True) -> None:
        self._translated = translated
        self.buses = Buses()
        self.damaged = 0
        """Lines that are no frame."""
        self.ends_early: list[str] = []
        """Why a log breaks off, with its name."""
        self._done: dict[str, int] = {}
        names = [os.fspath(path) for path in paths]
        files = [os.path.realpath(name) for name in names]
        if twice := next((name for i, name in enumerate(names) if files[i] in files[:i]), None):
            raise LogError(f"{twice}: given twice; several logs are pieces of one recording, one after another")
        self.size = sum(map(_size, names))
        """Bytes of all files, as far as they have a size."""
        opened = [self._open(path) for path in names]
        opened.sort(key=lambda log: log[0])  # stable: logs that all start at 0 stay as given
        self.paths = [path for _, path, _ in opened]
        self._chunks = [chunks for _, _, chunks in opened]

    @property
    def done(self) -> int:
        """Bytes of `size` that have been read."""
        return sum(self._done.values())

    def chunks(self) -> Iterator[Frames]:
        """Yield all frames; this can be asked for once.

        Yields
        ------
        Frames
            A part of them at a time, in recorded order, with recorded times [µs].

        Raises
        ------
        LogError
            A log cannot be read on.
        """
        for chunks in self._chunks:
            yield from chunks

    def _open(self, path: str) -> tuple[int, str, Iterator[Frames]]:
        """Yield time of the first frame [us], path, and all chunks."""
        chunks = self._guarded(path, _reader(path)(self, path))
        first = next(chunks, None)
        if first is None:
            raise LogError(f"{path}: holds no CAN frame{self._why_none(path)}")

        def all_chunks() -> Iterator[Frames]:
            yield first
            yield from chunks

        return int(first["time_us"][0]), path, all_chunks()

    def _why_none(self, path: str) -> str:
        if self.damaged:
            return f"; {self.damaged} lines of it are something else: is it a log of candump -L?"
        return f": {self.ends_early[-1].removeprefix(f'{path}: ')}" if self.ends_early else ""

    def _guarded(self, path: str, chunks: Iterator[Frames]) -> Iterator[Frames]:
        """Yield the chunks; what breaks off after the first of them is noted, not raised."""
        while True:
            try:
                frames = next(chunks, None)
            except OSError as error:
                if isinstance(error, gzip.BadGzipFile) or error.errno is None:
                    self.ends_early.append(f"{path}: {error}")
                    return
                raise LogError(f"cannot read {path}: {error.strerror}") from None
            except (EOFError, zlib.error) as error:
                self.ends_early.append(f"{path}: the compressed file is cut off or damaged ({error})")
                return
            if frames is None:
                return
            if len(frames):
                yield identifiers.translate(frames) if self._translated else frames

    # --- candump ------------------------------------------------------------------------------------------------------

    def _candump(self, path: str) -> Iterator[Frames]:
        with _open_text(path) as (text, position):
            rest, skipping = b"", False
            for block in _blocks(text):
                self._done[path] = position()
                if skipping:  # the rest of a line that is too long to be one
                    newline = block.find(b"\n")
                    block, skipping = (block[newline + 1 :], False) if newline >= 0 else (b"", True)
                parsed = parse(rest + block, self.buses)
                self.damaged += parsed.damaged
                rest = (rest + block)[parsed.used :]
                if len(rest) > LONGEST_LINE:
                    self.damaged += 1
                    rest, skipping = b"", True
                yield parsed.frames
            if rest:
                parsed = parse(rest + b"\n", self.buses)
                self.damaged += parsed.damaged
                self.ends_early.append(f"{path}: its last line has no end")
                yield parsed.frames

    # --- everything else, through python-can --------------------------------------------------------------------------

    def _python_can(self, path: str) -> Iterator[Frames]:
        import can

        messages: list[can.Message] = []
        try:
            with _open_log(path) as reader:
                for message in reader:
                    messages.append(message)
                    if len(messages) == _MESSAGES:
                        yield self._frames(messages)
                        messages = []
            self.ends_early += _why_short(path, reader)
        except Exception as error:  # each format has its own, from struct.error to those of asammdf
            if isinstance(error, OSError) and error.errno is not None:
                raise
            self.ends_early.append(f"{path}: {_one_line(error)}")
        self._done[path] = _size(path)
        if messages:
            yield self._frames(messages)

    def _frames(self, messages: list[Any]) -> Frames:
        """python-can's messages as frames."""
        buses = {channel: self._bus(channel) for channel in {message.channel for message in messages}}
        self.damaged += sum(buses[message.channel] is None for message in messages)
        kept = [message for message in messages if buses[message.channel] is not None]
        frames = np.zeros(len(kept), FRAME)
        frames["time_us"] = np.rint(np.array([message.timestamp for message in kept]) * 1e6).astype(np.int64)
        frames["id"] = [message.arbitration_id for message in kept]
        frames["bus"] = [buses[message.channel] for message in kept]
        frames["length"] = [0 if message.is_fd else min(message.dlc, 8) for message in kept]
        frames["flags"] = [_flags(message) for message in kept]
        data = b"".join(bytes(message.data[:8]).ljust(8, b"\0") for message in kept)
        frames["data"] = np.frombuffer(data, np.uint8).reshape(-1, 8)
        return frames

    def _bus(self, channel: Any) -> int | None:
        """Return a bus by python-can's channel, which may be a number or missing; a name holds no blanks."""
        return self.buses.index("can" if channel is None else "_".join(str(channel).split()) or "can")


def _flags(message: Any) -> int:
    return (
        (EXTENDED if message.is_extended_id else 0)
        | (REMOTE if message.is_remote_frame else 0)
        | (ERROR if message.is_error_frame else 0)
        | (FD if message.is_fd else 0)
    )


def _open_log(path: str) -> Any:
    """python-can's reader. Raises LogError, and OSError for what the system says."""
    import can

    with quiet_asammdf():
        try:
            return can.LogReader(path)
        except Exception as error:  # each format has its own, from struct.error to those of asammdf
            if isinstance(error, OSError) and error.errno is not None:
                raise
            reason = _one_line(error)
        gc.collect()
    raise LogError(reason)


def _why_short(path: str, reader: Any) -> list[str]:
    """Return why a BLF has less in it than was recorded, by its header; python-can reads it without a word."""
    length = getattr(reader, "file_size", None)
    if length is None or path.endswith(_COMPRESSED):
        return []
    if not length:
        return [f"{path}: its header has no length: the recorder did not close it"]
    size = _size(path)
    return [f"{path}: {size:,} bytes of the {length:,} that its header says"] if size < length else []


def _one_line(error: Exception) -> str:
    return " ".join((str(error) if isinstance(error, LogError) else f"{type(error).__name__}: {error}").split())


# --- files ----------------------------------------------------------------------------------------------------------


def _reader(path: str) -> Callable[[Recording, str], Iterator[Frames]]:
    """Return how a file is read, by its name. Raise LogError, and LeverError where an extra is missing."""
    suffix = Path(path.removesuffix(_COMPRESSED)).suffix.lower()
    if path == "-" or suffix in _CANDUMP or not _is_file(path):
        return Recording._candump
    if suffix in _OTHERS:
        if suffix == ".mf4":
            require("mf4")
        return Recording._python_can
    formats = ", ".join((*filter(None, _CANDUMP), *_OTHERS))
    raise LogError(f"{path}: {suffix} is not a known format of CAN logs: {formats}, each also with {_COMPRESSED}")


def _is_file(path: str) -> bool:
    """Return False for what is there but has no end known before, such as a pipe.

    Raise LogError for what is not there.
    """
    try:
        mode = os.stat(path).st_mode
    except OSError as error:
        raise LogError(f"cannot read {path}: {error.strerror}") from None
    if stat.S_ISDIR(mode):
        raise LogError(f"cannot read {path}: it is a folder")
    return stat.S_ISREG(mode)


def _size(path: str) -> int:
    return os.stat(path).st_size if path != "-" and _is_file(path) else 0


def _blocks(text: Any) -> Iterator[bytes]:
    """Yield all of it; of a compressed file that is damaged all that comes before the damage, then its error."""
    if not isinstance(text, gzip.GzipFile):
        while block := text.read(BLOCK):
            yield block
        return
    while True:
        parts, size, broken = [], 0, None
        try:
            while size < BLOCK and (part := text.read1(BLOCK)):
                parts.append(part)
                size += len(part)
        except (EOFError, OSError, zlib.error) as error:
            broken = error
        if parts:
            yield b"".join(parts)
        if broken is not None:
            raise broken
        if not parts:
            return


@contextmanager
def _open_text(path: str) -> Iterator[tuple[Any, Callable[[], int]]]:
    """Yield the file object of a text that may be compressed, and a function that counts the bytes read so far."""
    if path == "-":
        with open(sys.stdin.fileno(), "rb", buffering=0, closefd=False) as file:
            yield file, lambda: 0
        return
    with open(path, "rb", buffering=0) as file:
        if not _is_file(path):
            yield file, lambda: 0
            return
        magic = file.read(len(_GZIP))
        file.seek(0)
        yield gzip.GzipFile(fileobj=file) if magic == _GZIP else file, file.tell
