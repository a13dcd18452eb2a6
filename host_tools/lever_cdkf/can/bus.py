"""The firmware inside this process as a python-can interface: `can.Bus(interface="lever", channel="any name")`.

What is sent goes into an estimator of the firmware at once, and its answers can be received when send() returns.

- One bus, one estimator. `channel` is a label for logs: two buses with the same channel share nothing. Whoever wants to
  listen in gets everything by `receive_own_messages=True` and a can.Notifier; `can_bridge` joins it to any other bus.
- Time is the firmware's, not the clock's: frames carry, in seconds, the sample time of the last BASE_SAMPLE that was
  accepted (0 before), continued beyond the 32 bits of time_us and never going back. Logs are therefore reproducible.
- recv() does not wait for what cannot come: if only the calling thread has sent so far, every answer is already there,
  and with none left it returns None at once, whatever the timeout, and `for message in bus` ends. Other threads wait as
  usual.
- A motor command is as old as the last sample: nobody calls lever_idle() here, since no clock runs.
- Extended, remote and error frames pass and are not for the firmware, as on a real bus; CAN FD does not exist here.
- At most `rx_queue_size` frames wait to be received; then the oldest are dropped, with one warning in the log.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from can import BusABC, CanInitializationError, CanOperationError, Message
from can.typechecking import CanFilters

from ..errors import LeverError
from ..firmware.aircraft import AircraftResponse
from ..firmware.config import Config
from ..firmware.estimator import FRAME_SAMPLE, Estimator, Recorder
from ..firmware.settings_file import make_config, read_assignments
from .codec import raw_field

LOG = logging.getLogger("can.lever")

_MEANINGLESS = {"single_handle", "bitrate", "timing", "fd"}  # python-can's tools and configuration files pass these
_OPTIONS = "config, settings, aircraft, snapshots, receive_own_messages, rx_queue_size, can_filters"
_NOBODY, _SEVERAL = 0, -1  # senders; no thread has these identifiers


class LeverBusError(LeverError, CanInitializationError):
    """A LeverBus that cannot be made as asked."""


class LeverBus(BusABC):
    """The firmware as a bus; see the module.

    `estimator` is the firmware instance, for a look at health() and estimate().

    Parameters
    ----------
    channel
        A name for logs.
    can_filters
        As of any bus of python-can.
    config
        Configuration of the firmware; its defaults if neither this nor `settings` is given.
    settings
        Instead of `config`: settings and choices by name, or the path of a settings file.
    aircraft
        The helicopter whose margin to collective bounce the firmware watches.
    snapshots
        Also send the state of the firmware so often, as SNAPSHOT [s].
    receive_own_messages
        Also receive what is sent, before the answers to it.
    rx_queue_size
        Most frames that wait to be received.
    **kwargs
        What python-can's tools pass to any bus, such as `bitrate`; it means nothing here.

    Raises
    ------
    LeverBusError
        An option is unknown or wrong; it is a CanInitializationError too.
    """

    def __init__(
        self,
        channel: Any = "lever",
        can_filters: CanFilters | None = None,
        *,
        config: Config | None = None,
        settings: Mapping[str, str | float] | str | os.PathLike[str] | None = None,
        aircraft: AircraftResponse | None = None,
        snapshots: float | None = None,
        receive_own_messages: bool = False,
        rx_queue_size: int = 65536,
        **kwargs: Any,
    ) -> None:
        unknown = sorted(kwargs.keys() - _MEANINGLESS)
        if unknown:
            raise LeverBusError(f"interface 'lever' has no option {', '.join(unknown)}; it has {_OPTIONS}")
        if kwargs.get("fd"):
            raise LeverBusError("interface 'lever' is classic CAN: it has no fd")
        if not isinstance(rx_queue_size, int) or rx_queue_size < 1:
            raise LeverBusError(f"rx_queue_size is {rx_queue_size!r}; it must be a number of frames, at least 1")
        self.estimator = Estimator(_configuration(config, settings))
        self.estimator.watch(aircraft)
        self._recorder = None if snapshots is None else Recorder(self.estimator, snapshots)
        self.channel = str(channel)
        self.channel_info = f"lever firmware in this process, channel {self.channel!r}"
        self.receive_own_messages = receive_own_messages
        self._queue: SimpleQueue[Message | None] = SimpleQueue()
        self._queue_size = rx_queue_size
        self._dropped = False
        self._sending = threading.Lock()  # an instance of the firmware serves one thread at a time
        self._sender = _NOBODY
        self._sample_time = raw_field("BASE_SAMPLE", "time_us")
        self._time_us: int | None = None
        self._timestamp = 0.0
        super().__init__(channel, can_filters)

    def send(self, msg: Message, timeout: float | None = None) -> None:
        """Hand a frame to the firmware and queue its answers; never wait.

        Parameters
        ----------
        msg
            A classic frame.
        timeout
            Without meaning here.

        Raises
        ------
        can.CanOperationError
            The frame is one of CAN FD, or the bus is shut down.
        """
        data = msg.data
        if msg.is_fd or len(data) > 8:
            raise CanOperationError(f"interface 'lever' is classic CAN: it has no FD frames and no {len(data)} bytes")
        with self._sending:
            if self._is_shutdown:
                raise CanOperationError(f"{self.channel_info} is shut down")
            thread = threading.get_ident()
            if self._sender != thread:
                self._sender = thread if self._sender == _NOBODY else _SEVERAL
            is_sample = False
            if not (msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame):
                is_sample = self.estimator.on_frame(msg.arbitration_id, data) == FRAME_SAMPLE
            if is_sample:
                self._advance(self._sample_time(data))
            if self.receive_own_messages:
                self._put(self._own(msg))
            self._answer(is_sample)

    def recv(self, timeout: float | None = None) -> Message | None:
        """Return the oldest frame not yet received.

        Overrides BusABC.recv, which would go on asking until the timeout has passed (without one, for ever).

        Parameters
        ----------
        timeout
            How long to wait [s]; None: until a frame comes.

        Returns
        -------
        can.Message or None
            None after the timeout, or at once where no frame can come.

        Raises
        ------
        can.CanOperationError
            The bus is shut down.
        """
        deadline = None
        while True:
            if self._is_shutdown:
                raise CanOperationError(f"{self.channel_info} is shut down")
            try:
                message = self._queue.get_nowait()
            except Empty:
                if self._sender == threading.get_ident():
                    return None
                if deadline is None and timeout is not None:
                    deadline = time.monotonic() + timeout
                message = self._wait(deadline)
                if message is None and not self._is_shutdown:
                    return None
            if message is not None and (self._filters is None or self._matches_filters(message)):
                return message

    def __iter__(self) -> Iterator[Message]:
        """Yield what recv() returns, until it returns None: who has sent alone gets every answer, and an end."""
        while (message := self.recv()) is not None:
            yield message

    def flush_tx_buffer(self) -> None:
        """Do nothing: what was sent has arrived."""

    def shutdown(self) -> None:
        """End the bus; a thread that waits in recv() gets a CanOperationError. May be called again."""
        super().shutdown()
        self._queue.put(None)

    def _wait(self, deadline: float | None) -> Message | None:
        try:
            return self._queue.get(timeout=None if deadline is None else max(0.0, deadline - time.monotonic()))
        except Empty:
            return None

    def _advance(self, time_us: int) -> None:
        """Continue the time by a sample's 32 bits; less than half their range ahead is forward, all else is late."""
        if self._time_us is None:
            self._time_us = time_us
        else:
            ahead = (time_us - self._time_us) & 0xFFFFFFFF
            self._time_us += ahead if ahead < 1 << 31 else 0
        self._timestamp = self._time_us * 1e-6

    def _answer(self, is_sample: bool) -> None:
        """Queue what the estimator has to say after a frame, of which a sample is to be taken first."""
        estimator = self.estimator
        if is_sample:
            estimator.step()
        while (answer := estimator.next_frame()) is not None:
            self._put(self._from_estimator(*answer))
        if is_sample and self._recorder is not None:
            for identifier, data in self._recorder.frames():
                self._put(self._from_estimator(identifier, data))

    def _from_estimator(self, identifier: int, data: bytes) -> Message:
        return Message(
            timestamp=self._timestamp,
            arbitration_id=identifier,
            is_extended_id=False,
            channel=self.channel,
            data=data,
        )

    def _own(self, msg: Message) -> Message:
        return Message(
            timestamp=self._timestamp,
            arbitration_id=msg.arbitration_id,
            is_extended_id=msg.is_extended_id,
            is_remote_frame=msg.is_remote_frame,
            is_error_frame=msg.is_error_frame,
            channel=self.channel,
            dlc=msg.dlc,
            data=bytes(msg.data),
            is_rx=False,
        )

    def _put(self, message: Message) -> None:
        if self._queue.qsize() >= self._queue_size:
            if not self._dropped:
                self._dropped = True
                LOG.warning("%s: nobody receives; of %d frames the oldest are dropped", self, self._queue_size)
            with suppress(Empty):  # another thread may have received it meanwhile
                self._queue.get_nowait()
        self._queue.put(message)


def _configuration(
    config: Config | None, settings: Mapping[str, str | float] | str | os.PathLike[str] | None
) -> Config | None:
    if settings is None:
        return config
    if config is not None:
        raise LeverBusError("interface 'lever' takes config or settings, not both")
    try:
        return make_config(settings if isinstance(settings, Mapping) else read_assignments(settings))
    except LeverError as error:
        raise LeverBusError(str(error)) from None
