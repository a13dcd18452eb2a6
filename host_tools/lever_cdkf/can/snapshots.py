"""The estimator's state in a recording: what SNAPSHOT frames say."""

from __future__ import annotations

import zlib
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from . import codec
from .bulk import Frames

NAME = "SNAPSHOT"
_BEGIN, _DATA, _END = 0, 1, 2
_DATA_BYTES = 6


class Snapshot(NamedTuple):
    """One of them."""

    begin: int
    """Place of its first frame among the frames."""
    ended: bool
    """Its last frame is there."""
    time_us: int
    """Of the sample after which the state was this, 32 bits [us]."""
    layout: int
    """As lever_state_layout() of the façade."""
    digest: int | None
    """CRC-32 of the state; None before its end."""
    state: bytes | None
    """All of it; None where frames of it are missing."""


def find(frames: Frames) -> list[Snapshot]:
    """Return the snapshots that begin among frames of one bus; frames that came twice count once."""
    places = np.flatnonzero(frames["id"] == codec.message(NAME).frame_id)
    data = np.ascontiguousarray(frames["data"][places])
    again = np.zeros(len(places), np.bool_)
    again[1:] = (data[1:] == data[:-1]).all(axis=1)
    places, data = places[~again], data[~again]
    part, counter = data[:, 1] >> 4, data[:, 1] & 15
    begins = np.flatnonzero(part == _BEGIN)
    found = []
    for first, after in pairwise([*begins, len(places)]):
        ends = np.flatnonzero(part[first:after] == _END)
        fields = codec.decode_columns(NAME, data[first : first + 1])
        digest = state = None
        if len(ends):
            last = first + ends[0]
            end = codec.decode_columns(NAME, data[last : last + 1])
            digest, length = int(end["digest"][0]), int(end["length"][0])
            in_order = bool(((counter[first + 1 : last + 1] - counter[first:last]) & 15 == 1).all())
            content = data[first + 1 : last, 2:].tobytes()
            if in_order and len(content) == -(-length // _DATA_BYTES) * _DATA_BYTES:
                state = content[:length] if zlib.crc32(content[:length]) == digest else None
        found.append(
            Snapshot(
                int(places[first]), bool(len(ends)), int(fields["time_us"][0]), int(fields["layout"][0]), digest, state
            )
        )
    return found
