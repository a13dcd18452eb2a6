"""Time of the simulated board, and what is to happen when; nothing here runs by itself."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable

Action = Callable[[], None]


class Schedule:
    """`now` [ns] only goes forward, in advance()."""

    def __init__(self) -> None:
        self.now = 0
        self._queue: list[tuple[int, int, Action]] = []
        self._numbers = itertools.count()

    def at(self, time_ns: int, action: Action) -> None:
        heapq.heappush(self._queue, (max(time_ns, self.now), next(self._numbers), action))

    def next_ns(self) -> int | None:
        """When something happens next, if anything."""
        return self._queue[0][0] if self._queue else None

    def advance(self, time_ns: int) -> None:
        """Do what is due until then, in order, each at its own time."""
        while self._queue and self._queue[0][0] <= time_ns:
            due, _, action = heapq.heappop(self._queue)
            self.now = max(self.now, due)
            action()
        self.now = max(self.now, time_ns)


class Timers:
    """The events of one peripheral, which end together when it is reset."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self._generation = 0

    def after(self, delay_ns: int, action: Action) -> None:
        self.at(self.schedule.now + delay_ns, action)

    def at(self, time_ns: int, action: Action) -> None:
        self.schedule.at(time_ns, self.guard(action))

    def guard(self, action: Action) -> Action:
        """Do nothing when it comes after a cancel()."""
        generation = self._generation
        return lambda: action() if generation == self._generation else None

    def cancel(self) -> None:
        self._generation += 1
