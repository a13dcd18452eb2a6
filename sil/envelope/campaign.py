"""Runs conditions: each motion is simulated once, several at a time, and forgotten when its conditions are judged."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from lever_cdkf.host_tools.config import Config
from lever_cdkf.host_tools.errors import SettingsError

from . import firmware, pilots, plant
from .condition import ClosedLoop, Condition, Limit
from .measure import FIGURES, Excerpt, Outcome, Values, excerpt
from .motions import Motion, Recording, lanes, truth
from .sensors import measured

LANES = 64
"""Simulated at a time; 60 s of them take 300 MB."""

Show = Callable[[int, int, str], None]
"""Progress: done, total, what."""


class Group(NamedTuple):
    """Conditions with the same of all this are of one recording."""

    motion: Motion
    runs: int
    closed_loop: ClosedLoop | None


@dataclass(frozen=True)
class Result:
    """A condition and what was measured."""

    condition: Condition
    values: Mapping[str, Values]
    """Figures, one value a run; empty when it could not be run."""
    excerpt: Excerpt | None = None
    problem: str = ""
    """Why it could not be run."""

    def of(self, limit: Limit) -> float:
        """What is held against a limit; NaN without runs."""
        if limit.figure not in self.values:
            return math.nan
        figure, values = FIGURES[limit.figure], self.values[limit.figure]
        if limit.over == "median":
            return float(np.median(values))
        return figure.worst(values) if limit.over == "worst" else figure.pool(values)

    @property
    def ok(self) -> bool:
        """Whether the limits hold, or those that do instead."""
        if self.problem:
            return False
        condition = self.condition
        held = (all(limit.holds(self.of(limit)) for limit in group) for group in (condition.limits, condition.unless))
        return next(held) or (bool(condition.unless) and next(held))


def run(rows: Sequence[Condition], everything: Mapping[str, Condition], seeds: int, show: Show) -> Iterator[Result]:
    """The results of the rows, in no particular order; `seeds` runs of each, or some times as many where runs draw."""
    wanted = {row.name for row in rows}
    references = [everything[row.against] for row in rows if row.against is not None and row.against not in wanted]
    groups: dict[Group, list[Condition]] = {}
    for row in (*references, *rows):  # a reference has the motion of what is measured against it
        groups.setdefault(Group(row.motion, row.runs, row.closed_loop), []).append(row)
    done = 0
    for group, recording in _recordings(groups, seeds):
        outcomes: dict[str, Outcome] = {}
        for row in sorted(groups[group], key=lambda row: row.against is not None):
            show(done, len(rows), row.name)
            try:
                outcome = _outcome(row, recording, range(seeds * row.runs), outcomes.get(row.against or ""))
            except SettingsError as error:
                result = Result(row, {}, problem=str(error))
            else:
                outcomes[row.name] = outcome
                values = {name: FIGURES[name].compute(outcome) for name in row.figures}
                result = Result(row, values, excerpt(outcome))
            if row.name in wanted:
                done += 1
                yield result


def _outcome(row: Condition, recording: Recording | None, seeds: Sequence[int], reference: Outcome | None) -> Outcome:
    config = Config(settings=row.settings)
    if recording is None:
        loop = row.closed_loop or ClosedLoop()
        recording, track = firmware.closed_loop(config, row.motion, seeds, loop.dither, loop.lost, loop.whole)
    else:
        track = firmware.estimates(config, measured(recording, row.sensors, seeds))
    return Outcome(recording, track, row.window, row.events, reference)


def _recordings(groups: Iterable[Group], seeds: int) -> Iterator[tuple[Group, Recording | None]]:
    """What happens in each; None where the firmware itself has a part in it."""
    batches: dict[float, list[Group]] = {}
    for group in groups:
        if group.closed_loop is not None:
            yield group, None
        elif group.motion.pilot != "arm":
            yield group, pilots.record(group.motion, range(seeds * group.runs))
        else:
            batch = batches.setdefault(group.motion.duration, [])
            if batch and seeds * sum(each.runs for each in (*batch, group)) > LANES:
                yield from _simulated(batch, seeds)
                batch.clear()
            batch.append(group)
    for batch in batches.values():
        yield from _simulated(batch, seeds)


def _simulated(batch: Sequence[Group], seeds: int) -> Iterator[tuple[Group, Recording]]:
    """Motions of one duration, side by side."""
    given = [lanes(group.motion, range(seeds * group.runs)) for group in batch]
    theta, theta_dot = plant.run(plant.beside(given))
    first = 0
    for group, part in zip(batch, given, strict=True):
        own = slice(first, first + seeds * group.runs)
        first = own.stop
        signals = (theta[:, own], theta_dot[:, own], part.tau_m, part.z_ddot)
        yield group, Recording(group.motion.time, *signals, truth(part))
