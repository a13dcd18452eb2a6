"""The C of firmware/can, compiled by itself and called through cffi, and the DBC that it must agree with."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import cantools
from cantools.database.can import Database, Message, Signal
from cffi import FFI

FIRMWARE = Path(__file__).parents[3] / "firmware"
DBC = cast(Database, cantools.database.load_file(FIRMWARE / "can/lever.dbc"))
MULTIPLEXED = {"PILOT_PARAMETERS": "parameter", "PILOT_SIGMA": "sigma"}
"""Messages whose values are an array in C, in the order of the DBC's multiplexed signals."""
TO_NAME = {0x00: "OK", 0x01: "NO_NEW_DATA", 0x02: "CRC_ERROR", 0x03: "SYNC", 0x04: "INITIAL", 0x08: "REPEATED"}
TO_NAME |= {0x20: "SOME_LOST", 0x40: "WRONG_SEQUENCE"}


def data_id_base(message: Message) -> int:
    """Return the E2E data ID of counter 0."""
    assert message.dbc is not None
    return int(message.dbc.attributes["E2EDataIdBase"].value)


def limits(signal: Signal) -> tuple[int, int]:
    """Return least and greatest raw value that the bits of a signal hold."""
    least = -(1 << signal.length - 1) if signal.is_signed else 0
    return least, least + (1 << signal.length) - 1


def is_quantity(signal: Signal) -> bool:
    """Return a physical value, as opposed to a code, flag or count."""
    return signal.scale != 1


def not_available(signal: Signal) -> int:
    """Return the raw value that says so, of a quantity."""
    least, greatest = limits(signal)
    return least if signal.is_signed else greatest


def scaled(signal: Signal, raw: int) -> float:
    """Return the physical value of a raw one, by cantools."""
    return float(cast(float, signal.raw_to_scaled(raw, decode_choices=False)))


def build(folder: Path) -> Path:
    """Compile the codec in the folder into a shared library; beside it, with the suffix .cdef, what cffi needs."""
    compiler = shlex.split(os.environ.get("CC", "cc"))
    flags = ["-std=c99", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Werror"]
    library = folder / "codec.so"
    sources = sorted((FIRMWARE / "can").glob("*.c"))
    subprocess.run([*compiler, *flags, "-O2", "-fPIC", "-shared", "-I", FIRMWARE, *sources, "-o", library], check=True)
    for header in ("stdint.h", "stdbool.h", "stddef.h"):
        (folder / header).touch()
    (folder / "codec.h").write_text('#include "can/e2e.h"\n#include "can/messages.h"\n')
    preprocess: list[str | Path] = [
        "-E",
        "-P",
        "-std=c99",
        "-nostdinc",
        "-I",
        folder,
        "-I",
        FIRMWARE,
        folder / "codec.h",
    ]
    subprocess.run([*compiler, *preprocess, "-o", library.with_suffix(".cdef")], check=True)
    return library


class Codec:
    """The functions of messages.h and e2e.h on bytes and dicts."""

    def __init__(self, library: Path) -> None:
        self.ffi = FFI()
        self.ffi.cdef(library.with_suffix(".cdef").read_text())
        self.lib: Any = self.ffi.dlopen(str(library))

    def enum(self, name: str) -> dict[str, int]:
        """Return the constants of an enum."""
        return dict(self.ffi.typeof(f"enum {name}").relements)

    def members(self, message: str) -> list[str]:
        """Return the members of a message's struct."""
        return [name for name, _ in self.ffi.typeof(f"message_{message.lower()}_t").fields]

    def frame(self, frame_id: int, data: bytes) -> Any:
        """Return a lever_frame_t."""
        return self.ffi.new("lever_frame_t *", {"id": frame_id, "length": len(data), "data": data.ljust(8, b"\0")})

    def encode(self, message: str, values: Mapping[str, Any]) -> bytes | None:
        """Return the eight bytes, with CRC and counter 0; None if refused. Members that are not given are 0."""
        frame = self.frame(0, bytes(8))
        struct = self.ffi.new(f"message_{message.lower()}_t *", dict(values))
        done = getattr(self.lib, f"message_{message.lower()}_encode")(frame, struct)
        return bytes(frame.data) if done else None

    def decode(self, message: str, data: bytes, frame_id: int | None = None) -> dict[str, Any] | None:
        """Return the members of the message, which comes under its own identifier or another; None if refused."""
        frame = self.frame(getattr(self.lib, f"MESSAGE_{message}_ID") if frame_id is None else frame_id, data)
        struct = self.ffi.new(f"message_{message.lower()}_t *")
        if not getattr(self.lib, f"message_{message.lower()}_decode")(struct, frame):
            return None
        values = {name: getattr(struct, name) for name in self.members(message)}
        return {name: list(value) if name in MULTIPLEXED.values() else value for name, value in values.items()}

    def protect(self, data: bytes, data_id_base: int, counter: int) -> bytes:
        frame = self.frame(0, data)
        self.lib.e2e_protect(frame, data_id_base, counter)
        return bytes(frame.data)

    def receiver(
        self, data_id_base: int, max_delta_counter: int, max_no_new_or_repeated: int, sync_counter: int
    ) -> Any:
        """Return a fresh e2e_receiver_t."""
        receiver = self.ffi.new("e2e_receiver_t *")
        tolerance = self.ffi.new("e2e_tolerance_t *", [max_delta_counter, max_no_new_or_repeated, sync_counter])
        self.lib.e2e_receiver_init(receiver, data_id_base, tolerance[0])
        return receiver

    def check(self, receiver: Any, data: bytes | None) -> tuple[str, int]:
        """Status without its prefix, and the number of lost frames."""
        frame = self.ffi.NULL if data is None else self.frame(0, data)
        return TO_NAME[self.lib.e2e_check(receiver, frame)], receiver.lost
