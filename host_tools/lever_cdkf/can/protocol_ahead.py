"""Serial ports that read ahead, for pyserial: "ahead://" before a device or a URL, as in ahead:///dev/ttyUSB0.

python-can's slcan asks for one byte at a time, which costs two system calls each. Here they come out of memory. POSIX
only; only input is different.
"""

from __future__ import annotations

import importlib
import os
import select
import time
from typing import Any

import serial

_SCHEME = "ahead://"
_CHUNK = 4096


def read_ahead(channel: str) -> str:
    """Return the channel to give to python-can's slcan instead of `channel`."""
    package = __name__.rpartition(".")[0]
    if os.name != "posix":
        return channel
    if package not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append(package)
    return _SCHEME + channel


class _ReadAhead:
    """What is read differently from the class of port that this is mixed into."""

    _ahead = b""
    _timeout: float | None
    fileno: Any

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read without waiting, at least."""
        return len(self._ahead) or int(super().in_waiting)  # type: ignore[misc]

    def read(self, size: int = 1) -> bytes:
        """`size` bytes, or what has come of them in the port's timeout."""
        end = None if self._timeout is None else time.monotonic() + self._timeout
        while len(self._ahead) < size:
            left = None if end is None else max(0.0, end - time.monotonic())
            if not select.select([self.fileno()], [], [], left)[0]:
                break
            chunk = os.read(self.fileno(), _CHUNK)
            if not chunk:
                raise serial.SerialException("the other end of the line is gone")
            self._ahead += chunk
        taken, self._ahead = self._ahead[:size], self._ahead[size:]
        return taken

    def reset_input_buffer(self) -> None:
        """Forget what has come."""
        self._ahead = b""
        super().reset_input_buffer()  # type: ignore[misc]


def serial_class_for_url(url: str) -> tuple[str, type]:
    """Return the URL without our scheme, and the class that opens it: a hook of pyserial."""
    inner = url[len(_SCHEME) :]
    scheme, colon, _ = inner.partition("://")
    base = importlib.import_module(f"serial.urlhandler.protocol_{scheme}").Serial if colon else serial.Serial
    return inner, type("Serial", (_ReadAhead, base), {})
