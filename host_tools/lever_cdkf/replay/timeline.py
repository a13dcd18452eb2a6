"""When each sample of a recording was: the sender's own clock where it can be believed, the recorder's where not.

A sample carries the sender's time in 32 bits of microseconds, which wrap every 71.6 minutes and start over with the
sender; the recorder's stamps of the same samples jitter, and may be set back. From one sample to the next both should
advance alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..firmware.sample_clock import period_of
from ..numeric.arrays import IntArray

WRAP = 1 << 32
AGREEMENT = 1_000_000
"""Difference [us] up to which a step of both clocks is the same step."""
GAP = 1.5
"""Sample periods between two samples from which on samples are missing."""


@dataclass
class Clocks:
    """What was found about time."""

    samples: int = 0
    wraps: int = 0
    """Times that the sender's 32 bits ran over."""
    restarts: int = 0
    """Times that the sender's clock jumped: the recorder's step was taken."""
    late: int = 0
    """Samples not newer than the one before them."""
    recorder_jumps: int = 0
    """Steps in which the recorder's clock went back or jumped, against the sender's."""
    gaps: int = 0
    """Steps longer than GAP sample periods."""
    longest_gap_s: float = 0.0


class Timeline:
    """Seconds since the first sample, a piece at a time; never going back."""

    def __init__(self, period: float) -> None:
        """`period`: that of the samples [s]."""
        self.clocks = Clocks()
        self.typical_step_us = 0
        """Step between samples of the first piece [us]; 0 before it."""
        self._period_us = period * 1e6
        self._now = 0  # [us] since the first sample
        self._last: tuple[int, int] | None = None  # recorded and sample time of the last one [us]

    def seconds(self, recorded_us: IntArray, sample_us: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times [s] of one or more samples with these recorded times and these 32-bit times of the sender."""
        sender = sample_us.astype(np.int64)
        recorded_0, sender_0 = self._last or (int(recorded_us[0]), int(sender[0]))
        steps = self._steps(np.diff(recorded_us, prepend=recorded_0), np.diff(sender, prepend=sender_0))
        if self._last is None:
            self.clocks.late -= 1  # the first sample is no step
            self.typical_step_us = round(period_of(steps[1:], self._period_us)) if len(steps) > 1 else 0
        self._last = int(recorded_us[-1]), int(sender[-1])
        self._note_gaps(steps)
        time_us = self._now + np.cumsum(steps)
        self._now = int(time_us[-1])
        self.clocks.samples += len(steps)
        seconds: NDArray[np.float64] = time_us / 1e6
        return seconds

    def _steps(self, recorded: IntArray, sender: IntArray) -> IntArray:
        """Return the steps to believe, none below 0; sender's are of 32-bit times."""
        short = (sender + WRAP // 2) % WRAP - WRAP // 2
        unwrapped = short + WRAP * np.rint((recorded - short) / WRAP).astype(np.int64)
        agreed = (np.abs(recorded - unwrapped) < AGREEMENT) & (unwrapped > 0)
        late = ~agreed & (short <= 0) & (short > -AGREEMENT)
        sender_runs = ~agreed & ~late & (short > 0) & (short < AGREEMENT)
        restarted = ~(agreed | late | sender_runs)
        steps = np.where(agreed, unwrapped, np.where(late, 0, np.where(sender_runs, short, np.maximum(recorded, 0))))
        self.clocks.wraps += int(np.sum((agreed | sender_runs) & (sender < 0)))
        self.clocks.late += int(late.sum())
        self.clocks.recorder_jumps += int(sender_runs.sum())
        self.clocks.restarts += int(restarted.sum())
        return steps.astype(np.int64)

    def _note_gaps(self, steps: IntArray) -> None:
        gaps = steps[steps > GAP * self._period_us]
        self.clocks.gaps += len(gaps)
        self.clocks.longest_gap_s = max(self.clocks.longest_gap_s, float(gaps.max()) / 1e6 if len(gaps) else 0.0)
