"""The SLCAN codec of the firmware in Python (through cffi), and a serial port with it at the other end."""

from __future__ import annotations

import functools
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
COMPILERS = "cc|gcc|clang"
IDENTITY = ("1042", "T3ST")


@dataclass(frozen=True)
class Frame:
    """A frame as the codec has it."""

    id: int
    data: bytes
    length: int
    extended: bool = False
    remote: bool = False


@functools.cache
def library() -> tuple[cffi.FFI, Any]:
    """Return the codec, compiled for this test run."""
    compiler = next(path for name in COMPILERS.split("|") if (path := shutil.which(name)))
    header = FIRMWARE / "port/slcan/slcan.h"
    ffi = cffi.FFI()
    with tempfile.TemporaryDirectory() as scratch:
        for name in ("stdint.h", "stdbool.h"):  # cffi knows what is in them
            Path(scratch, name).touch()
        preprocess = [compiler, "-E", "-P", "-std=c99", "-nostdinc", "-I", scratch, "-I", str(FIRMWARE), str(header)]
        ffi.cdef(subprocess.run(preprocess, check=True, capture_output=True, text=True).stdout)
        shared = Path(scratch, "slcan.so")
        sources = ["-I", str(FIRMWARE), str(header.with_suffix(".c")), "-o", str(shared)]
        subprocess.run([compiler, "-std=c99", "-O1", "-shared", "-fPIC", *sources], check=True)
        return ffi, ffi.dlopen(str(shared))


class Peer:
    """The codec's peer, with endless room for its answers unless `room` says how much."""

    def __init__(self) -> None:
        self.ffi, self.lib = library()
        self.output = bytearray()
        self.room: int | None = None
        self.received: list[Frame] = []
        self._put = self.ffi.callback("bool(void *, const char *, uint32_t)", self._take_answer)
        self._slcan = self.ffi.new("slcan_t *")
        self._frame = self.ffi.new("slcan_frame_t *")
        sink = self.ffi.new("slcan_sink_t *", {"self": self.ffi.NULL, "put": self._put})
        version, serial = (text.encode() for text in IDENTITY)
        self.lib.slcan_init(
            self._slcan, sink, self.ffi.new("slcan_identity_t *", {"version": version, "serial": serial})
        )

    @property
    def state(self) -> Any:
        """slcan_t."""
        return self._slcan

    def take(self, data: bytes) -> None:
        """Bytes from the host; frames in them are added to `received`."""
        for byte in data:
            if self.lib.slcan_take(self._slcan, byte, self._frame):
                self.received.append(as_frame(self._frame))

    def send(self, frame: Frame, time_ms: int = 0) -> bool:
        """Return a frame to the host."""
        inner = {"id": frame.id, "length": frame.length, "data": frame.data.ljust(8, b"\0")}
        sent = self.ffi.new("slcan_frame_t *", {"frame": inner, "extended": frame.extended, "remote": frame.remote})
        return bool(self.lib.slcan_send(self._slcan, sent, time_ms))

    def _take_answer(self, _: Any, text: Any, length: int) -> bool:
        if self.room is not None and length > self.room:
            return False
        self.output += self.ffi.unpack(text, length)
        return True


def as_frame(frame: Any) -> Frame:
    """Return a slcan_frame_t."""
    inner = frame.frame
    data = b"" if frame.remote else bytes(inner.data)[: inner.length]
    return Frame(inner.id, data, inner.length, bool(frame.extended), bool(frame.remote))


def read_frame(line: bytes) -> Frame | None:
    """Return what the codec reads in a line of an adapter, without its CR."""
    ffi, lib = library()
    taken, frame = ffi.new("slcan_line_t *"), ffi.new("slcan_frame_t *")
    for byte in line + b"\r":
        end = lib.slcan_line_take(taken, byte)
    good = end == lib.SLCAN_CR and lib.slcan_read_frame(taken, True, frame)
    return as_frame(frame) if good else None


class Port:
    """As much of a serial.Serial as python-can uses; what is written goes to the peer, or nowhere without one."""

    write_timeout: float | None = None

    def __init__(self, peer: Peer | None, incoming: bytearray) -> None:
        self._peer = peer
        self._incoming = incoming

    @property
    def in_waiting(self) -> int:
        return len(self._incoming)

    def read(self, size: int) -> bytes:
        taken = bytes(self._incoming[:size])
        del self._incoming[:size]
        return taken

    def write(self, data: bytes) -> int:
        if self._peer is not None:
            self._peer.take(data)
        return len(data)

    def flush(self) -> None: ...

    def close(self) -> None: ...
