"""Whole recordings at once, through the C of c/bulk.h: candump's text, and frames through an estimator.

Frames are numpy arrays of dtype FRAME, rows (a sample and all that belongs to it) of dtype ROW; the fields are those of
bulk_frame_t and bulk_row_t in c/bulk.h, which says what they mean.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..firmware.estimator import Estimator
from ..firmware.library import ffi, load, struct_dtype
from . import codec

_lib = load("lever_bulk")

FRAME = struct_dtype("bulk_frame_t")
ROW = struct_dtype("bulk_row_t")
Frames = NDArray[Any]
"""Of dtype FRAME."""
Rows = NDArray[Any]
"""Of dtype ROW."""

EXTENDED: int = _lib.BULK_EXTENDED
REMOTE: int = _lib.BULK_REMOTE
ERROR: int = _lib.BULK_ERROR
FD: int = _lib.BULK_FD
ANSWER: int = _lib.BULK_ANSWER
LONGEST_LINE: int = _lib.BULK_LINE

ANSWERS = (
    *("STATE_ESTIMATE", "PILOT_PARAMETERS", "PILOT_SIGMA", "PILOT_DYNAMICS", "FEEDTHROUGH", "HEALTH", "LINK_HEALTH"),
    *("MOTOR_COMMAND", "STABILITY", "CORRECTION", "TEST_RATIO"),
)
"""The messages of the estimator that rows hold, in the order of their slots."""
SLOTS = {name: slot for slot, name in enumerate(("LEVER_SAMPLE", "BASE_SAMPLE", "GRIP_SAMPLE", *ANSWERS))}
"""Slot of each message in a row."""
RECORDED = {name: len(SLOTS) + slot for slot, name in enumerate(ANSWERS)}
"""Slot of each answer as the recording has it."""

_SHORTEST_LINE = 13  # "(0.0) a 000#\n"
_LONGEST_WRITTEN = int(_lib.BULK_BUS_NAME) + 64


class Buses:
    """Names of the buses in a recording; a frame's `bus` is an index into them."""

    def __init__(self) -> None:
        self.pointer = ffi.new("bulk_buses_t *")

    def names(self) -> list[str]:
        """Return all so far."""
        return [ffi.string(self.pointer.name[i]).decode(errors="replace") for i in range(self.pointer.count)]

    def index(self, name: str) -> int | None:
        """Return the place of a name, which is added if it is new; None when it is too long or there are too many."""
        names = self.names()
        if name in names:
            return names.index(name)
        encoded = name.encode()
        if len(names) >= _lib.BULK_BUSES or len(encoded) >= _lib.BULK_BUS_NAME:
            return None
        self.pointer.name[len(names)] = encoded
        self.pointer.count += 1
        return len(names)


class Parsed(NamedTuple):
    """What a piece of text was."""

    frames: Frames
    used: int
    """Bytes of it that are done with: all whole lines."""
    damaged: int
    """Lines that are no frame."""


def parse(text: bytes, buses: Buses) -> Parsed:
    """Return the frames in the whole lines of a text in candump's format."""
    frames = np.empty(len(text) // _SHORTEST_LINE + 1, FRAME)
    parsed = ffi.new("bulk_parsed_t *")
    room = ffi.from_buffer("bulk_frame_t[]", frames)
    count = _lib.bulk_parse(ffi.from_buffer(text), len(text), buses.pointer, room, len(frames), parsed)
    return Parsed(frames[:count], parsed.used, parsed.damaged)


def format_lines(frames: Frames, bus: str) -> NDArray[np.uint8]:
    """Return the frames, all with 11-bit identifiers, as lines in candump's format, to be written as bytes."""
    text = np.empty(len(frames) * _LONGEST_WRITTEN, np.uint8)
    source = ffi.from_buffer("bulk_frame_t[]", np.ascontiguousarray(frames))
    size = _lib.bulk_format(source, len(frames), bus.encode(), ffi.from_buffer("char[]", text))
    return text[:size]


class Feeder:
    """Feeds frames to an estimator in bulk."""

    def __init__(self, estimator: Estimator, frames_at_once: int = 65536) -> None:
        self.estimator = estimator
        self._feeder = ffi.new("bulk_feeder_t *")
        self._feeder.lever_id = codec.message("LEVER_SAMPLE").frame_id
        self._feeder.base_id = codec.message("BASE_SAMPLE").frame_id
        self._feeder.grip_id = codec.message("GRIP_SAMPLE").frame_id
        self._feeder.command_id = codec.message("COMMAND").frame_id
        self._feeder.answer_id = [codec.message(name).frame_id for name in ANSWERS]
        self._out = np.empty(frames_at_once, FRAME)
        self._rows = np.empty(frames_at_once // 3, ROW)
        self._fed = ffi.new("bulk_fed_t *")

    @property
    def refused(self) -> int:
        """Frames that the estimator did not accept."""
        return int(self._feeder.refused)

    def feed(self, frames: Frames) -> Iterator[tuple[Frames, Rows]]:
        """Feed the frames of one bus, all classic data frames with 11-bit identifiers, and yield pieces of them.

        A piece holds

        - the frames fed, each followed by its answers (flag ANSWER), valid until the next piece, and
        - the rows of the samples that are complete with it; the last one is kept back until flush().
        """
        source = ffi.from_buffer("bulk_frame_t[]", np.ascontiguousarray(frames))
        done = 0
        while done < len(frames):
            out, rows = ffi.from_buffer("bulk_frame_t[]", self._out), ffi.from_buffer("bulk_row_t[]", self._rows)
            lever, left = self.estimator.pointer, len(frames) - done
            _lib.bulk_feed(
                self._feeder, lever, source + done, left, out, len(self._out), rows, len(self._rows), self._fed
            )
            done += self._fed.taken
            yield self._out[: self._fed.out], self._rows[: self._fed.rows].copy()

    def flush(self) -> Rows:
        """Return the row of the last sample, if there was one."""
        rows = np.empty(1 if self._feeder.has_row else 0, ROW)
        if self._feeder.has_row:
            rows[0] = np.frombuffer(ffi.buffer(ffi.addressof(self._feeder, "row")), ROW)[0]
            self._feeder.has_row = 0
        return rows
