"""bus.log: every frame of a run, both ways, in the format of candump -L.

Byte for byte what python-can's CanutilsLogWriter writes (a test compares them), but in whole columns: that writer takes
2 us a frame, two thirds of what a whole simulated sample may cost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_HEX = np.frombuffer(b"0123456789ABCDEF", dtype=np.uint8)


@dataclass(frozen=True)
class Frames:
    """Classic 8-byte frames in the order in which they were on the bus; arrays of equal length."""

    time_us: NDArray[np.int64]
    """Simulated time [us]."""
    identifier: NDArray[np.uint16]
    """11 bits."""
    data: NDArray[np.uint8]
    """(count, 8)."""
    received: NDArray[np.bool_]
    """From the estimator; otherwise sent to it."""

    def __len__(self) -> int:
        return len(self.identifier)

    def of(self, identifier: int) -> NDArray[np.intp]:
        """Where the frames with this identifier are."""
        return np.flatnonzero(self.identifier == identifier)


def lines(frames: Frames, channel: str) -> Iterator[bytes]:
    """Yield the log in pieces.

    Lines whose seconds have the same number of digits have the same length and go together.
    """
    seconds = frames.time_us // 1_000_000
    digits = np.char.str_len(seconds.astype(np.str_)) if len(frames) else np.zeros(0, dtype=np.int64)
    edges = np.flatnonzero(np.diff(digits)) + 1
    for part in np.split(np.arange(len(frames)), edges):
        if len(part):
            yield _equal_lines(frames, part, int(digits[part[0]]), channel)


def _equal_lines(frames: Frames, part: NDArray[np.intp], digits: int, channel: str) -> bytes:
    """Return the lines of the frames `part`, all with `digits` digits in the seconds, as one matrix of characters."""
    template = f"({'0' * digits}.000000) {channel} 000#{'0' * 16} T\n".encode()
    text = np.tile(np.frombuffer(template, dtype=np.uint8), (len(part), 1))
    stamp = frames.time_us[part]
    for column in (*range(digits + 7, digits + 1, -1), *range(digits, 0, -1)):
        text[:, column] = _HEX[stamp % 10]
        stamp = stamp // 10
    identifier = digits + 11 + len(channel)
    for nibble in range(3):
        text[:, identifier + nibble] = _HEX[(frames.identifier[part] >> (8 - 4 * nibble)) & 0xF]
    data = frames.data[part]
    text[:, identifier + 4 : identifier + 20 : 2] = _HEX[data >> 4]
    text[:, identifier + 5 : identifier + 20 : 2] = _HEX[data & 0xF]
    text[frames.received[part], identifier + 21] = ord("R")
    return text.tobytes()
