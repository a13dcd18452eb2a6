"""Where the frames of a view come from: a bus, or a recorded log at the pace of its time stamps.

A thread of the source takes frames as they come and does nothing else with them; they wait, at most MOST_WAITING, until
the view takes them at its own rate. The view may therefore be as slow as it likes: the bus does not notice.
"""

from __future__ import annotations

import importlib.metadata
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from ..can import codec
from ..can.buses import make_room, open_bus
from ..can.commander import ACCEPTED, KEEP_ALIVE, SEQUENCE, UNANSWERED, Commander, refusal, result_of
from ..errors import LeverError
from .picture import ERROR, FOREIGN, STEP, Frame, Picture

if TYPE_CHECKING:
    import can

    from ..can.bulk import Buses, Frames
    from ..firmware.config import Config
    from ..numeric.arrays import ComplexArray, FloatArray

MOST_WAITING = 65536
"""Frames: eight seconds of a full bus of 1 Mbit/s."""
LONGEST_PAUSE = 5.0
"""[s] A longer gap of a log is not waited for."""
_SWITCH_INTERVAL = 5e-4  # [s] after which drawing gives way to receiving; Python's own is ten times that
_TRIES = 5  # of a COMMAND, KEEP_ALIVE apart: longer than a sequence lasts that another sender has left
_LISTEN = 0.2  # [s] a receiving thread waits before it looks whether it is to end


SIMULATIONS = "lever_cdkf.simulations"
"""Entry point group with one function, which makes a source and its estimator's configuration of a scenario."""


def _dithers(values: Mapping[str, codec.Value]) -> bool | None:
    """Return whether a COMMAND asks for dither; None where it says nothing of it."""
    rms = values.get("dither_rms")
    return rms > 0.0 if isinstance(rms, int | float) else None


class Source(ABC):
    """Frames from a thread that run() is, between start() and stop()."""

    title = ""
    """What is watched, for people."""
    takes_commands = False
    simulated = False
    """Whether truth() knows what the estimator is to find."""
    run_number = 1
    """Counts how often what is watched begins."""

    def __init__(self) -> None:
        self.dropped = 0
        """Frames that nobody took in time."""
        self.ended = False
        """Whether no more will come, though nobody has called stop()."""
        self.error: str | None = None
        """Why not, when something went wrong."""
        self.warning: str | None = None
        """A fault in a part of it, of which the rest is used."""
        self._waiting: deque[Frame] = deque(maxlen=MOST_WAITING)
        self._start = time.monotonic()
        self._switch_interval: float | None = None  # of before start()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="lever frames", daemon=True)
        self._commander = Commander()
        self._commanded = 0.0
        self._pending: Mapping[str, codec.Value] = {}  # of command(), not yet acknowledged,
        self._tries: list[int] = []  # sent with these counters
        self._why_not = ""
        self._dithers = False  # by a COMMAND of this source that was accepted
        self.refusals: deque[str] = deque(maxlen=16)
        """Why COMMANDs were refused; to be taken from here."""

    @abstractmethod
    def run(self) -> None:
        """Put frames until self._stopping is set or none are left. Raises what went wrong."""

    def start(self) -> None:
        """Begin to receive, in a thread."""
        self._switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)
        self._start = time.monotonic()
        self._thread.start()

    def check(self) -> None:
        """Raise LeverError for its error."""
        if self.error is not None:
            raise LeverError(self.error)

    def stop(self) -> None:
        """End the thread and release what it used; may be called again."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout=3.0)
        if self._switch_interval is not None:
            sys.setswitchinterval(self._switch_interval)
            self._switch_interval = None

    @property
    def now(self) -> float:
        """[s] since start()."""
        return time.monotonic() - self._start

    def drain(self) -> list[Frame]:
        """Return the frames that have come since the last call."""
        return [self._waiting.popleft() for _ in range(len(self._waiting))]

    def command(self, values: Mapping[str, codec.Value]) -> None:
        """Send a COMMAND: the fields of the message, and of the ones before as far as they are not acknowledged.

        Those not given change nothing. Raise LeverError.
        """
        if not self.takes_commands:
            raise LeverError(f"{self.title} takes no commands")
        self._pending, self._why_not = {**self._pending, **values}, UNANSWERED
        self._dithers = self._dithers and _dithers(values) is not False
        self._tries = [self._send(self._pending)]

    def acknowledged(self, ack: Mapping[str, float]) -> None:
        """Take the fields of a COMMAND_ACK.

        What is out of sequence is not refused for good: the last sender may have stopped at this counter, or a moment
        ago.
        """
        result = result_of(ack)
        own = bool(self._pending) and int(ack["command_counter"]) in self._tries
        if own and result == SEQUENCE:
            self._why_not = refusal(result)
            return
        if result != ACCEPTED:
            self.refusals.append(refusal(result))
        elif own and (dithers := _dithers(self._pending)) is not None:
            self._dithers = dithers
        if own:
            self._pending = {}

    def keep_alive(self) -> None:
        """Repeat a COMMAND when it is time: one that is not acknowledged, or any, so that dither goes on.

        That is dither asked for here. To be called several times a second as long as somebody watches it.
        """
        if time.monotonic() - self._commanded < KEEP_ALIVE:
            return
        if not self._pending:
            if self._dithers:
                self._send({})
        elif len(self._tries) < _TRIES:
            self._tries.append(self._send(self._pending))
        else:
            self._pending = {}
            self.refusals.append(self._why_not)

    def end_dither(self) -> None:
        """End the dither that was asked for here, if there is any."""
        if self._dithers or _dithers(self._pending):
            self.command({"dither_rms": 0.0})

    def truth(self, frequencies: FloatArray) -> tuple[dict[str, float], ComplexArray] | None:
        """Return what is true now, which the estimator never sees; None where that is not known.

        It is parameters and dynamics by name, and θ/z̈ [rad/(m/s²)] at the frequencies [Hz].
        """
        return None

    def _send(self, values: Mapping[str, codec.Value]) -> int:
        """Return its counter."""
        self._commanded = time.monotonic()
        return self._commander.send(values, self._transmit)

    def _transmit(self, identifier: int, data: bytes) -> None:
        """Send a frame, where commands are taken. Raise LeverError."""
        raise NotImplementedError

    def _put(self, frame: Frame) -> None:
        if len(self._waiting) == MOST_WAITING:
            self.dropped += 1
        self._waiting.append(frame)

    def _run(self) -> None:
        try:
            self.run()
        except Exception as error:  # whatever a bus or a reader comes up with is for the view to show, in one line
            if not self._stopping.is_set():
                self.error = " ".join(str(error).split()) or type(error).__name__
        self.ended = not self._stopping.is_set()


class BusSource(Source):
    """Any python-can bus. Nothing is sent but by command()."""

    takes_commands = True

    def __init__(self, interface: str, channel: str | None, options: Mapping[str, Any] | None = None) -> None:
        """Open the bus. Raise LeverError."""
        super().__init__()
        self.title = interface if channel is None else f"{interface} {channel}"
        self._bus = open_bus(interface, channel, options or {})
        make_room(self._bus)

    def run(self) -> None:
        """Receive until stop() is called."""
        receive, put, stopping = self._bus.recv, self._put, self._stopping
        while not stopping.is_set():
            message = receive(_LISTEN)
            if message is not None:
                put(as_frame(message))

    def stop(self) -> None:
        """End the thread and close the bus."""
        super().stop()
        self._bus.shutdown()

    def _transmit(self, identifier: int, data: bytes) -> None:
        import can

        try:
            self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=data), timeout=0.5)
        except (can.CanError, OSError) as error:
            raise LeverError(f"{self.title} did not take the command: {error}") from None
        self._put((identifier, data))


class PlayedLog(Protocol):
    """What a LogSource plays: a can.logs.Recording, or frames that are made from a log of other signals."""

    buses: Buses
    damaged: int
    ends_early: list[str]

    def chunks(self) -> Iterator[Frames]:
        """Yield frames in recorded order."""


class LogSource(Source):
    """A recorded log; `channel` chooses among several in it. What of it cannot be read is a `warning` at its end."""

    def __init__(
        self,
        path: str,
        channel: str | None = None,
        log: PlayedLog | None = None,
        part: tuple[float, float] = (0.0, float("inf")),
    ) -> None:
        """Open the log, unless `log` is it; of it `part` is played: start and length [s]. Raise LeverError."""
        from ..can.logs import Recording

        super().__init__()
        self.title = path
        self._channel = channel
        self._log: PlayedLog = Recording([path]) if log is None else log
        self._part = part

    def run(self) -> None:
        """Receive until stop() is called."""
        due = time.monotonic()
        for pause, frame in self._frames():
            due += pause
            wait = due - time.monotonic()
            if wait > 0.0 and self._stopping.wait(wait):
                return
            self._put(frame)

    def read_into(self, picture: Picture) -> None:
        """Read the whole log at once, as if it had been played to its end. Raise LeverError."""
        now, due, batch = 0.0, STEP, list[Frame]()
        for pause, frame in self._frames():
            now += pause
            if now >= due:
                picture.take(batch, now)
                due, batch = now + STEP, []
            batch.append(frame)
        picture.take(batch, now)

    def _frames(self) -> Iterator[tuple[float, Frame]]:
        """Yield each frame with the time after the one before it [s].

        A clock that went back or jumped far counts as 0.
        """
        from ..can.bulk import ERROR as ERROR_FRAME
        from ..can.logs import incomplete

        last: int | None = None
        start_us: int | None = None
        for chunk in self._log.chunks():
            start_us = int(chunk["time_us"][0]) if start_us is None else start_us
            since = (chunk["time_us"] - start_us) * 1e-6
            frames = chunk[((since >= self._part[0]) | (self._part[0] == 0.0)) & (since < sum(self._part))]
            if self._channel is not None:
                names = self._log.buses.names()
                wanted = names.index(self._channel) if self._channel in names else len(names)
                frames = frames[frames["bus"] == wanted]
            columns = (frames[name].tolist() for name in ("time_us", "id", "flags", "length"))
            data = frames["data"].tobytes()
            for k, (time_us, identifier, flags, length) in enumerate(zip(*columns, strict=True)):
                pause = 0.0 if last is None else max(time_us - last, 0) * 1e-6
                last = time_us
                frame = (identifier, data[8 * k : 8 * k + length])
                if flags:
                    frame = (ERROR if flags & ERROR_FRAME else FOREIGN, b"")
                yield min(pause, LONGEST_PAUSE), frame
        if last is None:
            what = "in the part from --start on" if self._channel is None else f"of channel {self._channel} in it"
            raise LeverError(f"{self.title}: no CAN frame {what}")
        damaged = f"{self.title}: {self._log.damaged} lines of it are not frames." if self._log.damaged else ""
        sentence = incomplete(self._log.ends_early) or damaged
        if sentence not in (self.warning or ""):
            self.warning = f"{self.warning} {sentence}" if self.warning else sentence


def as_frame(message: can.Message) -> Frame:
    """Return what a view needs of a python-can message."""
    if message.is_error_frame:
        return ERROR, b""
    if message.is_extended_id or message.is_remote_frame or message.is_fd:
        return FOREIGN, b""
    return message.arbitration_id, message.data


def simulated(scenario: str) -> tuple[Source, Config]:
    """Return the pilot of a scenario in real time, by the name or the path of the scenario. Raise LeverError."""
    for entry in importlib.metadata.entry_points(group=SIMULATIONS):
        open_source: Callable[[str], tuple[Source, Config]] = entry.load()
        return open_source(scenario)
    raise LeverError("no simulation is installed here: give a bus or a log")
