"""Sources that do not speak lever.dbc: the firmware in this process estimates from their mapped signals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..can.bulk import Buses, Feeder, Frames
from ..firmware.aircraft import AircraftResponse
from ..firmware.config import Config
from ..firmware.estimator import FRAME_SAMPLE, Estimator
from ..signals.mapped_frames import MappedFrames
from ..signals.online import Online
from ..signals.reading import Reading
from ..signals.resample import at_period
from .sources import BusSource, LogSource


class MappedLog:
    """A PlayedLog: a mapped log with the estimator's answers."""

    def __init__(self, path: str, reading: Reading, config: Config, aircraft: AircraftResponse | None) -> None:
        """Read all of it. Raise LeverError."""
        self.buses = Buses()
        self._traffic = MappedFrames([path], reading)
        self._estimator = Estimator(self._traffic.at_its_rate(config))
        self._estimator.watch(aircraft)
        self.notes = self._traffic.loaded.notes
        """One sentence for each guess or oddity."""
        self.damaged, self.ends_early = self._traffic.recording.damaged, self._traffic.recording.ends_early

    def chunks(self) -> Iterator[Frames]:
        """Yield the frames that the mapped signals are as, in recorded order."""
        feeder = Feeder(self._estimator)
        for frames in self._traffic.chunks():
            for fed, _ in feeder.feed(frames):
                plain = fed.copy()
                plain["flags"] = 0
                yield plain


class MappedLogSource(LogSource):
    """A recorded log, or a file of columns."""

    def __init__(self, path: str, reading: Reading, config: Config, aircraft: AircraftResponse | None = None) -> None:
        log = MappedLog(path, reading, config, aircraft)
        super().__init__(path, None, log)
        self.warning = _said(log.notes)


class MappedBusSource(BusSource):
    """A bus on which there is no estimator. Nothing is sent."""

    takes_commands = False

    def __init__(
        self,
        interface: str,
        channel: str | None,
        online: Online,
        config: Config,
        options: Mapping[str, Any] | None = None,
        aircraft: AircraftResponse | None = None,
    ) -> None:
        """Open the bus. Raise LeverError."""
        self._online, self._aircraft = online, aircraft
        self._config = config
        self._estimator: Estimator | None = None
        super().__init__(interface, channel, options)

    def run(self) -> None:
        """Raise LeverError when the signals are not what the mapping says."""
        while not self._stopping.is_set():
            message = self._bus.recv(0.2)
            if message is None or message.is_error_frame or message.is_remote_frame:
                continue
            identifier, extended = message.arbitration_id, message.is_extended_id
            for frame in self._online.take(identifier, extended, bytes(message.data), message.timestamp):
                self._feed(*frame)

    def _feed(self, identifier: int, data: bytes) -> None:
        if self._estimator is None:
            assert self._online.period is not None  # it is known before the first frame
            self._estimator = Estimator(at_period(self._config, self._online.period))
            self._estimator.watch(self._aircraft)
            self.warning = _said(self._online.notes)
        self._put((identifier, data))
        if self._estimator.on_frame(identifier, data) == FRAME_SAMPLE:
            self._estimator.step()
        while (answer := self._estimator.next_frame()) is not None:
            self._put(answer)


def _said(notes: Sequence[str]) -> str | None:
    """Return what was guessed in one sentence, for the user to check; None without a guess."""
    return f"{'; '.join(notes)}." if notes else None
