"""How likely a recording is to the estimator with given settings; one part of it to tune on, another to judge by.

The estimator runs through all of the recording, as in flight. What it says counts from the end of its start on
(aligning, levels, the worst of a wrong first guess), and is added up over each part by itself. The seconds in which the
arm changes are not tuned on: no noise, walk or calibration explains them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..errors import LeverError
from ..firmware.innovations import innovations
from ..firmware.settings_file import Assignments, make_config
from ..numeric.arrays import Array
from ..text.counts import rounded_down
from .recording import Recording

START = 10.0
"""Longest time that is left to the start of the estimator [s], but at most START_SHARE of the recording."""
START_SHARE = 0.2
SHORTEST = 20.0
"""Least duration of a recording [s]."""
BEFORE_CHANGE, AFTER_CHANGE = 1.0, 3.0
"""What is left out beside the time for which the estimator reports a change [s]: until it sees it, and what follows."""
LEARNT_LEAST = 5.0
"""Of the part that is tuned on, the parameters must have learnt for so long [s], for their walk to be looked for."""


ShowProgress = Callable[[int, int, str], None]
"""Runs done, runs expected, what is being done."""


@dataclass
class Likelihood:
    """Of a recording. `held_out` is the share at its end that is only judged by."""

    recording: Recording
    held_out: float = 0.3
    runs: int = field(default=0, init=False)
    """How often the estimator has run through the recording."""
    progress: ShowProgress | None = field(default=None, init=False)
    """Is told of each run, once expect() has said what it is for."""
    changes: list[tuple[float, float]] = field(default_factory=list, init=False)
    """From when to when the estimator has reported a change of the arm [s of the recording]."""

    def __post_init__(self) -> None:
        """Raise LeverError for a recording that is too short."""
        duration = self.recording.duration + self.recording.period  # n samples last n periods
        if duration < SHORTEST - 0.5 * self.recording.period:
            there = f"{rounded_down(duration, 3):g} s of samples"
            raise LeverError(f"too short to tune on: {there}; at least {SHORTEST:g} s are needed")
        time, begin = self.recording.time, min(START, START_SHARE * duration)
        split = begin + (1.0 - self.held_out) * (duration - begin)
        self.tuned_on: Array = (time >= begin) & (time < split)
        """True at the samples that are tuned on."""
        self._wanted: Array = self.tuned_on
        self.judged_by: Array = time >= split
        """True at those that are held out."""
        self._doing, self._expected = "", 1

    def leave_out_changes(self, assignments: Assignments) -> bool:
        """Tune on those parts only in which the estimator, with these settings, finds no change of the arm.

        Where that would leave less than half of what is tuned on, all stays: then it is not the arm that changes.
        Return whether other parts are tuned on than before.
        """
        recording, before = self.recording, self.tuned_on
        changed = self.run(noise_as_set(assignments))["changed"]
        steps = np.diff(changed.astype(np.int8), prepend=0, append=0)
        time = np.append(recording.time, recording.duration)
        ends = zip(time[steps > 0].tolist(), time[steps < 0].tolist(), strict=True)
        self.changes = list(ends)
        kept = self._wanted.copy()
        for begin, end in self.changes:
            kept &= (recording.time < begin - BEFORE_CHANGE) | (recording.time > end + AFTER_CHANGE)
        self.tuned_on = kept if 2 * kept.sum() >= self._wanted.sum() else self._wanted
        return not np.array_equal(before, self.tuned_on)

    def longest_calm(self) -> tuple[float, float]:
        """Begin and length [s] of the longest part of the recording without a change."""
        begins = [0.0, *(end + AFTER_CHANGE for _, end in self.changes)]
        ends = [*(begin - BEFORE_CHANGE for begin, _ in self.changes), self.recording.duration]
        begin, end = max(zip(begins, ends, strict=True), key=lambda part: part[1] - part[0])
        return begin, end - begin

    def run(self, assignments: Assignments, delay: float = 0.0) -> Array:
        """Return what the estimator with these settings and choices makes of the samples.

        It is innovations.INNOVATION for each.

        A `delay` of the base acceleration [s] is undone before.
        """
        self.runs += 1
        result = innovations(make_config(assignments), self.recording.without_delay(delay))
        if self.progress is not None and self._doing:
            self.progress(min(self.runs, self._expected - 1), self._expected, self._doing)
        return result

    def expect(self, doing: str, runs: int | None = None) -> None:
        """Say what the next runs are for, and with `runs` how many more there are, about."""
        self._doing = doing
        self._expected = self._expected if runs is None else self.runs + runs

    def of(self, assignments: Assignments) -> float:
        """Return logarithm of the likelihood of the part that is tuned on; -inf where the filter breaks down."""
        total = float(self.run(assignments)["log_likelihood"][self.tuned_on].sum())
        return total if np.isfinite(total) else -np.inf

    def learnt(self, assignments: Assignments) -> float:
        """For how long the parameters learn in the part that is tuned on [s]."""
        return float(self.run(assignments)["learns"][self.tuned_on].sum()) * self.recording.period


def noise_as_set(assignments: Assignments) -> Mapping[str, str | float]:
    """Return the same settings without noise being estimated while running, which would hide what is wrong with it."""
    return {**assignments, "noise_window": 0.0}
