"""Rates and losses of one message, by the E2E counter and CRC of its frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from . import codec

RATE_WINDOW = 2.0
"""[s] over which a rate is the mean."""
_MARK_PERIOD = 0.1  # [s]
_EVENTS = ("COMMAND",)  # may have several senders, each with its own counter


class MessageCounter:
    """One message of lever.dbc as it passes. Counts are since the start or clear().

    A loss is told by a gap in the counter, which counts to 16: of up to 14 frames lost in a row all are seen, 15 look
    like a repetition, and of more only the rest of their number divided by 16. A corrupt frame is counted as that, not
    as lost.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.identifier = codec.message(name).frame_id
        self.sender = codec.message(name).senders[0]
        self.heard: float | None = None
        """When the last good frame came [s]; None: never."""
        self._counter: int | None = None
        self._corrupt_since = 0  # corrupt frames after the last good one
        self._marks: deque[tuple[float, int]] = deque(maxlen=round(RATE_WINDOW / _MARK_PERIOD) + 1)
        self._total = 0
        self.clear()

    def clear(self) -> None:
        """Start the counts again from 0."""
        self.frames = self.lost = self.corrupt = self.repeated = 0

    def take(self, frames: Iterable[bytes | bytearray], now: float) -> list[bytes | bytearray]:
        """Count frames that have come; return the good ones, without what was corrupt."""
        good = []
        for data in frames:
            self.frames += 1
            self._total += 1
            if not codec.check(self.identifier, data):
                self.corrupt += 1
                self._corrupt_since += 1
                continue
            self._follow(data[1] & 15)
            good.append(data)
        if good:
            self.heard = now
        return good

    def _follow(self, counter: int) -> None:
        if self._counter is not None and self.name not in _EVENTS:
            step = (counter - self._counter) & 15
            if step == 0:
                self.repeated += 1
            else:
                self.lost += max(0, step - 1 - self._corrupt_since)
        self._counter = counter
        self._corrupt_since = 0

    def tick(self, now: float) -> None:
        """To be called now and then, whether or not a frame has come."""
        if not self._marks or now - self._marks[-1][0] >= 0.995 * _MARK_PERIOD:
            self._marks.append((now, self._total))
        while len(self._marks) > 2 and now - self._marks[0][0] > 1.01 * RATE_WINDOW:
            self._marks.popleft()

    @property
    def rate(self) -> float:
        """Frames a second, good and corrupt; NaN before two ticks."""
        if len(self._marks) < 2:
            return float("nan")
        (then, before), (now, after) = self._marks[0], self._marks[-1]
        return (after - before) / (now - then)
