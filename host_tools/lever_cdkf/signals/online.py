"""A bus that does not speak lever.dbc, while it runs: its messages become samples as they come.

What a recording tells afterwards has to be decided in the beginning: for LEARNT seconds signals are only looked at, for
their rates, and for units and gravity where the mapping leaves them open.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from ..can import codec
from ..text.units import GRAVITY
from .bus_signals import find, load_database, number, of_fd
from .inputs import Input, samples_of, understood
from .mapping import Mapping, Source
from .recorded import Signal
from .resample import offset_between
from .units import INPUTS, factor

LEARNT = 2.0
"""[s]"""
LeverFrame = tuple[int, bytes]


class Online:
    """Turns messages into frames of lever.dbc."""

    def __init__(self, mapping: Mapping, database: str, clock: str | None = None) -> None:
        """Raise LeverError for a mapping that does not fit the database."""
        loaded = load_database(database)
        self.notes: list[str] = []
        """What was decided in the beginning."""
        self.period: float | None = None
        """Of the samples [s], once it is known."""
        self.fd = False
        """Whether any of the messages is CAN FD."""
        self._mapping, self._clock = mapping, clock
        self._wanted = defaultdict(list)
        for key, source in mapping.sources.items():
            message, signal = find(loaded, source.signal, database)
            self._wanted[message.frame_id, message.is_extended_frame].append((key, message, signal))
            self.fd = self.fd or of_fd(message)
        self._seen: dict[str, list[tuple[float, float]]] = {key: [] for key in mapping.sources}
        self._scale: dict[str, tuple[float, float]] = {}
        self._offset: dict[str, float] = {}  # [s] of the inputs that come with every sample, to its clock
        self._pending: dict[str, tuple[float, float]] = {}  # time and value of the last of each input
        self._counter = 0

    def take(self, identifier: int, extended: bool, data: bytes, time: float) -> list[LeverFrame]:
        """Return the frames of a sample that a message completes, mostly none.

        Raise LeverError when signals that have been looked at are not what the mapping says.
        """
        frames: list[LeverFrame] = []
        for key, message, signal in self._wanted.get((identifier, extended), ()):
            try:
                value = number(signal, message.decode(data, allow_truncated=True).get(signal.name))  # type: ignore[union-attr]
            except Exception:  # cantools raises what its decoder happens to; a frame that does not fit is no value
                continue
            source = self._mapping.sources[key]
            if self.period is None:
                self._look(key, time - source.delay, value)
            else:
                scale, offset = self._scale[key]
                frames += self._sample(key, scale * value + offset, time - source.delay)
        return frames

    # --- the beginning -----------------------------------------------------------------------------------------------

    def _look(self, key: str, time: float, value: float) -> None:
        self._seen[key].append((time, value))
        first = min(seen[0][0] for seen in self._seen.values() if seen)
        if time - first >= LEARNT:
            self._decide()

    def _decide(self) -> None:
        inputs: dict[str, Input] = {}
        for key, seen in self._seen.items():
            if seen or key in ("theta", "z_ddot"):
                inputs[key] = understood(key, self._mapping.sources[key], self._signal(key, seen))
        samples, self.notes = samples_of(inputs, self._clock)
        self._scale = {key: _line(key, each.source) for key, each in inputs.items()}
        self._clock, self.period = samples.clock, samples.period
        self._offset = {
            key: offset_between(samples.time, each.signal.time)
            for key, each in inputs.items()
            if samples.how[key] != "slower"
        }

    def _signal(self, key: str, seen: Sequence[tuple[float, float]]) -> Signal:
        (unit,) = (signal.unit or "" for wanted in self._wanted.values() for other, _, signal in wanted if other == key)
        time, values = np.array(seen, np.float64).reshape(-1, 2).T
        return Signal(self._mapping.sources[key].signal, time, values, unit)

    # --- samples -----------------------------------------------------------------------------------------------------

    def _sample(self, key: str, value: float, time: float) -> list[LeverFrame]:
        """Complete a sample with all that comes at its rate, or with the next value of its clock."""
        frames = self._frames() if key == self._clock and self._clock in self._pending else []
        self._pending[key] = time, value
        complete = self._clock in self._pending and all(map(self._belongs, self._offset))
        return frames + (self._frames() if complete else [])

    def _belongs(self, key: str) -> bool:
        """Return whether the last value of an input is of the sample that waits."""
        if key not in self._pending or self._clock is None or self.period is None:
            return False
        after = self._pending[key][0] - self._pending[self._clock][0]
        return abs(after - self._offset.get(key, 0.0)) <= 0.5 * self.period

    def _frames(self) -> list[LeverFrame]:
        """Return the sample that waits; what does not belong to it is missing, and what is later than it is kept."""
        assert self._clock is not None
        time = self._pending[self._clock][0]
        taken = {key for key in self._pending if self._belongs(key)}
        values = {
            key: self._pending[key][1] if key in taken else float("nan") for key in INPUTS if key in self._pending
        }
        theta, theta_dot, z_ddot, tau_m, grip = (values.get(key, float("nan")) for key in INPUTS)
        self._pending = {key: each for key, each in self._pending.items() if key not in taken and each[0] > time}
        self._counter += 1
        contents = {
            "LEVER_SAMPLE": (theta, theta_dot, tau_m),
            **({"GRIP_SAMPLE": (grip,)} if "grip_force" in self._mapping.sources else {}),
            "BASE_SAMPLE": (z_ddot, round(1e6 * time)),
        }
        return [
            (codec.message(name).frame_id, codec.encoder(name)(self._counter, *each)) for name, each in contents.items()
        ]


def _line(key: str, source: Source) -> tuple[float, float]:
    """Return factor and offset of a source in which everything is decided."""
    scale = source.factor if source.factor is not None else factor(key, source.unit)
    assert scale is not None
    sign = source.sign or 1
    return sign * scale, sign * source.offset - (GRAVITY if source.gravity == "included" else 0.0)
