"""Runs conditions: each motion is simulated once, several at a time, and forgotten when its conditions are judged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import Config

from ..acceptance.excerpt import Excerpt
from ..acceptance.result import ConditionResult
from ..batch import firmware, pilots
from ..batch.firmware import ClosedLoop
from ..batch.motions import Motion, Recording, simulated
from ..batch.sensors import measured
from .condition import Condition
from .measure import FIGURES, Outcome, excerpt

LANE_SECONDS = 64 * 60.0
"""Of all runs that are simulated at a time, which bounds the memory."""

Show = Callable[[int, int, str], None]
"""Progress: done, total, what."""
Tick = Callable[[], None]
"""Called now and then in what takes long."""


class Group(NamedTuple):
    """Conditions with the same of all this are of one recording."""

    motion: Motion
    runs: int
    closed_loop: ClosedLoop | None


class Job(NamedTuple):
    """Some seeds of a group, which are simulated together."""

    group: Group
    seeds: range


@dataclass(frozen=True)
class EnvelopeResult(ConditionResult):
    """A condition and what was measured."""

    known = FIGURES
    condition: Condition
    excerpt: Excerpt | None = None


def run(rows: Sequence[Condition], everything: Mapping[str, Condition], seeds: int, show: Show) -> list[EnvelopeResult]:
    """Return the results of the rows, in their order; `seeds` runs of each, or some times as many where runs draw."""
    references = [everything[row.against] for row in rows if row.against is not None]
    groups: dict[Group, list[Condition]] = {}
    for row in {row.name: row for row in (*references, *rows)}.values():  # a reference has the motion of its row
        groups.setdefault(Group(row.motion, row.runs, row.closed_loop), []).append(row)
    parts: dict[str, list[EnvelopeResult]] = {row.name: [] for own in groups.values() for row in own}
    jobs = [Job(group, each) for group in groups for each in _portions(seeds * group.runs, group.motion.duration)]
    total = sum(len(groups[job.group]) for job in jobs)

    def tick(what: str = "simulating") -> None:
        show(sum(len(each) for each in parts.values()), total, what)

    for job, recording in _recordings(jobs, tick):
        outcomes: dict[str, Outcome] = {}
        for row in groups[job.group]:
            tick(row.name)
            parts[row.name].append(_result(row, job.seeds, recording, outcomes, tick))
    return [_joined(parts[row.name]) for row in rows]


def _portions(runs: int, duration: float) -> list[range]:
    """Return seeds, not too many at a time."""
    most = _most_lanes(duration)
    return [range(first, min(first + most, runs)) for first in range(0, runs, most)]


def _most_lanes(duration: float) -> int:
    return max(1, int(LANE_SECONDS / duration))


def _joined(parts: Sequence[EnvelopeResult]) -> EnvelopeResult:
    """Return one result of some for different seeds; the excerpt is of the first."""
    first = parts[0]
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in first.values}
    return replace(first, values=values, runs=[name for part in parts for name in part.runs])


def _result(
    row: Condition, seeds: range, recording: Recording | None, outcomes: dict[str, Outcome], tick: Tick
) -> EnvelopeResult:
    """Run a condition; its outcome becomes one of `outcomes`, which later ones may be measured against."""
    try:
        config = Config(model=row.model, settings=row.settings)
    except SettingsError as error:
        return EnvelopeResult(row, {}, problem=str(error).partition(";")[0])
    if recording is None:
        assert row.closed_loop is not None
        recording, track = firmware.closed_loop(config, row.motion, seeds, row.closed_loop, tick)
    else:
        track = firmware.estimates(config, measured(recording, row.sensors, seeds), recording.response is not None)
    outcome = Outcome(recording, track, row.window, row.events, outcomes.get(row.against or ""), row.followed)
    outcomes[row.name] = outcome
    with np.errstate(all="ignore"):  # an estimate that is not finite is no warning but a figure that keeps no limit
        values = {name: FIGURES[name].compute(outcome) for name in row.figures}
        return EnvelopeResult(row, values, runs=[f"seed {seed}" for seed in seeds], excerpt=excerpt(outcome))


def _recordings(jobs: Iterable[Job], tick: Tick) -> Iterator[tuple[Job, Recording | None]]:
    """Yield what happens in each; None where the firmware itself has a part in it."""
    batches: dict[float, list[Job]] = {}
    for job in jobs:
        if job.group.closed_loop is not None:
            yield job, None
        elif job.group.motion.pilot != "arm":
            yield job, pilots.record(job.group.motion, job.seeds, tick)
        else:
            batch = batches.setdefault(job.group.motion.duration, [])
            if sum(len(each.seeds) for each in (*batch, job)) > _most_lanes(job.group.motion.duration):
                yield from _side_by_side(batch, tick)
                batch.clear()
            batch.append(job)
    for batch in batches.values():
        yield from _side_by_side(batch, tick)


def _side_by_side(batch: Sequence[Job], tick: Tick) -> Iterator[tuple[Job, Recording]]:
    """Yield motions of one duration."""
    yield from zip(batch, simulated([(job.group.motion, job.seeds) for job in batch], tick), strict=True)
