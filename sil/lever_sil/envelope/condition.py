"""What a condition is: how the lever moves, what the sensors make of it, and what the firmware must show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..acceptance.result import Limit
from ..batch.firmware import ClosedLoop
from ..batch.motions import Motion
from ..batch.sensors import Sensors

Interval = tuple[float, float]

FOLLOWED = 8.0
"""Unless a condition says otherwise [s]."""
REPORTED = ("f_n rms", "f_n covered", "zeta rms", "zeta covered", "flagged")
"""Figures of every condition whose pilot has a natural frequency."""


@dataclass(frozen=True)
class Condition:
    """A row of the table."""

    name: str
    title: str
    motion: Motion = field(default_factory=Motion)
    limits: tuple[Limit, ...] = ()
    """All must hold; without any the row is reported only."""
    unless: tuple[Limit, ...] = ()
    """Or these."""
    sensors: Sensors = field(default_factory=Sensors)
    settings: Mapping[str, float] = field(default_factory=dict)
    """Of the firmware, besides its defaults."""
    model: str | None = None
    """Of the firmware; None: its default."""
    start: float = 20.0
    """Judged from here on [s]."""
    end: float | None = None
    """To here [s]; None: to the end."""
    events: tuple[Interval, ...] = ()
    also: tuple[str, ...] = ()
    """Further figures, reported without a limit."""
    followed: float = FOLLOWED
    """So long after an event errors and settling are followed [s]."""
    against: str | None = None
    """Condition that it is measured against."""
    runs: int = 1
    """Runs for each seed, of which each draws anew."""
    quick: bool = False
    closed_loop: ClosedLoop | None = None

    @property
    def window(self) -> Interval:
        """Judged from and to [s]."""
        return self.start, self.motion.duration + 1.0 if self.end is None else self.end

    @property
    def figures(self) -> list[str]:
        """All that are measured."""
        always = REPORTED if self.motion.pilot == "arm" else ("flagged",)
        limited = (limit.figure for limit in (*self.limits, *self.unless))
        return list(dict.fromkeys((*limited, *self.also, *always)))
