"""The CAN messages for Wireshark: a profile that has its dissector "Signal PDU" name and scale every signal.

Wireshark reads no DBC, but tables of its own, of which a profile is a folder: a comma-separated row for each message,
signal, name of a value and identifier. Signals are listed from the first bit on without gaps; a gap is a hidden signal.
Wireshark knows negative numbers of 8, 16, 32 and 64 bits only: others are shown as if they had no sign, and a negative
one says by its name what to add.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..runtime.files import Outputs, write_text
from . import identifiers
from .codec import database

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

Row = tuple[str | float, ...]

_EVERY_MULTIPLEXER_VALUE = -1
_ANY_BUS = 0
_SIZES = (8, 16, 32, 64)


def write_profile(folder: Path) -> None:
    """Write the profile into a folder, such as ~/.config/wireshark/profiles/lever. Raises LeverError."""
    messages = database().messages
    tables: dict[str, Iterable[Row]] = {
        "Signal_PDU_identifiers": ((_hex(message.frame_id), message.name) for message in messages),
        "Signal_PDU_signal_list": (row for message in messages for row in _signals(message)),
        "Signal_PDU_signal_values": (row for message in messages for row in _values(message)),
        "Signal_PDU_Binding_CAN": (
            (_hex(identifiers.word(message.frame_id)), _hex(_ANY_BUS), _hex(message.frame_id)) for message in messages
        ),
    }
    with Outputs(folder) as outputs:
        for name, rows in tables.items():
            write_text(outputs.path(name), "".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in rows))
        outputs.finish()


def _hex(number: int) -> str:
    return f"{number:08x}"


def _fields(message: Message) -> list[Signal | int]:
    """Return the signals of a message from its first bit on; a number is so many bits of nothing."""
    fields: list[Signal | int] = []
    end = 0
    for signal in sorted(message.signals, key=lambda signal: signal.start):
        if signal.start > end:
            fields.append(signal.start - end)
        fields.append(signal)
        end = signal.start + signal.length
    return fields


def _signals(message: Message) -> Iterator[Row]:
    fields = _fields(message)
    for position, field in enumerate(fields):
        head = (_hex(message.frame_id), len(fields), position)
        if isinstance(field, int):
            gap = f"{message.name}.gap_{position}".lower()
            yield (*head, "-", gap, "uint", "FALSE", 64, field, 1.0, 0.0, "FALSE", _EVERY_MULTIPLEXER_VALUE, "TRUE")
            continue
        named = f"{field.name} [{field.unit}]" if field.unit not in (None, "", "1") else field.name
        kind = "int" if field.is_signed and field.length in _SIZES else "uint"
        only = field.multiplexer_ids[0] if field.multiplexer_ids else _EVERY_MULTIPLEXER_VALUE
        multiplexer = str(field.is_multiplexer).upper()
        size = next(size for size in _SIZES if size >= field.length)
        filtered = f"{message.name}.{field.name}".lower()
        scale, offset = float(field.scale), float(field.offset)
        yield (*head, named, filtered, kind, "FALSE", size, field.length, scale, offset, multiplexer, only, "FALSE")


def _values(message: Message) -> Iterator[Row]:
    for position, field in enumerate(_fields(message)):
        if isinstance(field, int):
            continue
        names = list(_named(field))
        for first, last, name in names:
            yield _hex(message.frame_id), position, len(names), f"{first:016x}", f"{last:016x}", name


def _named(field: Signal) -> Iterator[tuple[int, int, str]]:
    """Yield first and last bits, as they are in the frame, that have a name."""
    size = 1 << field.length
    for raw, name in sorted((field.choices or {}).items()):
        yield raw % size, raw % size, str(name)
    if field.is_signed and field.length not in _SIZES:
        yield size // 2 + 1, size - 1, f"add {-size * float(field.scale):g}"
