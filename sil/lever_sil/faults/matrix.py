"""Runs rows of the matrix, each with the same pilots."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from lever_cdkf.firmware.config import Config

from .flight import Pilot, Record
from .judge import RIGHT, SILENT, Verdict, judge
from .rows import MOTION, Row

Show = Callable[[int, int, str], None]
"""Progress: done, total, what."""


@dataclass(frozen=True)
class RowResult:
    """A row and what came of each pilot's flight."""

    row: Row
    verdicts: Sequence[Verdict]

    @property
    def broken(self) -> list[str]:
        """What the row demands and some flight did not keep."""
        broken = list(dict.fromkeys(what for verdict in self.verdicts for what in verdict.broken))
        return broken if self.covered >= RIGHT else [*broken, "right"]

    @property
    def silent(self) -> bool:
        """Some flight was wrong for long without a flag."""
        return self.worst("silent") >= SILENT

    def worst(self, figure: str) -> float:
        """Return the worst of all flights."""
        return max(verdict.measured[figure] for verdict in self.verdicts)

    @property
    def shown(self) -> Verdict:
        """The flight that was wrong longest without a flag, or else farthest off at its end."""
        return max(self.verdicts, key=lambda each: (each.measured["silent"], each.measured["error after"]))

    @property
    def covered(self) -> float:
        """Share of the samples without a flag that are right, of the quantity with the least [%]; all flights."""
        return sum(verdict.measured["covered"] for verdict in self.verdicts) / len(self.verdicts)


def run(rows: Iterable[Row], seeds: int, show: Show) -> list[RowResult]:
    """Return the results, in the order of the rows."""
    chosen = list(rows)
    verdicts: list[list[Verdict]] = [[] for _ in chosen]
    for seed in range(seeds):
        for i, verdict in enumerate(flights(chosen, Pilot(MOTION, seed))):
            verdicts[i].append(verdict)
            show(seed * len(chosen) + i + 1, seeds * len(chosen), chosen[i].name)
    return [RowResult(row, of) for row, of in zip(chosen, verdicts, strict=True)]


def flights(rows: Sequence[Row], pilot: Pilot) -> Iterator[Verdict]:
    """Yield each row flown by a pilot."""
    config = Config()
    plain: dict[tuple[bool, bool], Record] = {}
    for row in rows:
        like = row.grip, row.frozen
        if like not in plain:
            plain[like] = pilot.fly(config, row.time, grip=row.grip, frozen=row.frozen)
        record = pilot.fly(config, row.time, row.on_bus, row.on_readings, row.grip, row.frozen)
        yield judge(row.requirement, record, plain[like], pilot.truth, row.time)
