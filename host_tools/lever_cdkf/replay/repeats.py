"""Frames that a recording has twice in a row: recorded on two interfaces of one bus, or sent again."""

from __future__ import annotations

import numpy as np

from ..can import codec
from ..can.bulk import Frames
from ..can.estimator_frames import INPUTS


class Repeats:
    """Counts frames that are the one before them of the same message, to the bit."""

    def __init__(self) -> None:
        self.count = 0
        self._last: dict[str, int | None] = dict.fromkeys(INPUTS)

    def add(self, frames: Frames) -> None:
        """Further frames, all of one bus."""
        for name, last in self._last.items():
            data = frames["data"][frames["id"] == codec.message(name).frame_id]
            if len(data):
                words = np.ascontiguousarray(data).view("<u8")[:, 0]
                self.count += int(np.sum(words[1:] == words[:-1])) + (last == int(words[0]))
                self._last[name] = int(words[-1])
