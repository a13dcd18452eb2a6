"""Recorded times that go on where the recorder's clock was set back.

A recorder that is started again, or whose clock is set, writes times below those it has written. The data after that
place are as good as those before it: they follow one usual step later, and the place is noted.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ..numeric.arrays import FloatArray, IntArray

_Times = TypeVar("_Times", FloatArray, IntArray)
_LISTED = 5  # places in a sentence


class RunningClock:
    """Times of one recording, a part after another."""

    def __init__(self, least: float) -> None:
        """`least`: step back that is a clock set back; a smaller one is data out of order [unit of the times]."""
        self.set_back: list[tuple[float, float]] = []
        """Where in the running times, and by how much [unit of the times]."""
        self._least = least
        self._first: float = 0
        self._last: float | None = None  # as it was recorded
        self._ahead: float = 0  # of the running times
        self._step: float = 0  # usual

    def running(self, recorded: _Times) -> _Times:
        """Return the times of further data, of the same shape and type."""
        if not len(recorded):
            return recorded
        if self._last is None:
            self._first = self._last = recorded[0]
        steps = np.diff(recorded, prepend=self._last).astype(recorded.dtype)
        forward = steps[steps > 0]
        if len(forward):
            self._step = float(np.median(forward))
        back = steps < -self._least
        times = recorded + self._ahead + np.cumsum(np.where(back, self._step - steps, 0.0)).astype(recorded.dtype)
        self.set_back += [(float(at), float(-by)) for at, by in zip(times[back], steps[back], strict=True)]
        self._last, self._ahead = recorded[-1], times[-1] - recorded[-1]
        return times.astype(recorded.dtype)

    def note(self, seconds: float = 1.0) -> tuple[str, ...]:
        """Return a sentence on where the clock was set back, if it was; `seconds`: in a unit of the times."""
        if not self.set_back:
            return ()
        listed = ", ".join(
            f"at {seconds * (at - self._first):.4g} s by {seconds * by:,.6g} s" for at, by in self.set_back[:_LISTED]
        )
        more = f" and {len(self.set_back) - _LISTED:,} times more" if len(self.set_back) > _LISTED else ""
        return (f"The recorded time goes back {listed}{more}: the data after that are taken to follow without a gap",)
