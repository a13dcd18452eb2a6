"""The CAN messages for Wireshark: a profile that has its dissector "Signal PDU" name and scale every signal.

Wireshark reads no DBC, but tables of its own, of which a profile is a folder: a comma-separated row for each message,
signal, name of a value and identifier. Signals are listed from the first bit on without gaps; a gap is a hidden signal.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from .codec import database
from .files import make_folder, write_text

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

Row = tuple[str | float, ...]

_EVERY_MULTIPLEXER_VALUE = -1
_ANY_BUS = 0


def write_profile(folder: Path) -> None:
    """Writes the profile into a folder, such as ~/.config/wireshark/profiles/lever. Raises LeverError."""
    messages = database().messages
    make_folder(folder)
    tables: dict[str, Iterable[Row]] = {
        "Signal_PDU_identifiers": ((_hex(message.frame_id), message.name) for message in messages),
        "Signal_PDU_signal_list": (row for message in messages for row in _signals(message)),
        "Signal_PDU_signal_values": (row for message in messages for row in _values(message)),
        "Signal_PDU_Binding_CAN": (
            (_hex(message.frame_id), _hex(_ANY_BUS), _hex(message.frame_id)) for message in messages
        ),
    }
    for name, rows in tables.items():
        write_text(folder / name, "".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in rows))


def _hex(number: int) -> str:
    return f"{number:08x}"


def _fields(message: Message) -> list[Signal | int]:
    """The signals of a message from its first bit on; a number is so many bits of nothing."""
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
        kind = "int" if field.is_signed else "uint"
        only = field.multiplexer_ids[0] if field.multiplexer_ids else _EVERY_MULTIPLEXER_VALUE
        multiplexer = str(field.is_multiplexer).upper()
        size = next(size for size in (8, 16, 32, 64) if size >= field.length)
        filtered = f"{message.name}.{field.name}".lower()
        scale, offset = float(field.scale), float(field.offset)
        yield (*head, named, filtered, kind, "FALSE", size, field.length, scale, offset, multiplexer, only, "FALSE")


def _values(message: Message) -> Iterator[Row]:
    for position, field in enumerate(_fields(message)):
        if isinstance(field, int) or not field.choices:
            continue
        choices = field.choices
        for raw, name in sorted(choices.items()):
            yield _hex(message.frame_id), position, len(choices), f"{raw:016x}", f"{raw:016x}", str(name)
