"""Where the identifiers of lever.dbc are on a bus or in a log.

They are there as they are, higher by an offset, or, with 29 bits, by a base; firmware/port/identifiers.h is the other
end.

The choice is that of a command line, once for the process. What opens a bus or reads a log translates by it; all else
knows the identifiers of lever.dbc alone. A frame that is not ours gets an identifier that no message has.
"""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import can

    from .bulk import Frames

_MOST = 0x7FF
_EXTENDED = 1 << 31  # in a DBC, and in the word of identifiers.h
_FOREIGN = 1 << 28
"""In the identifier of a frame that is not ours, which has 29 bits then."""


class Identifiers(NamedTuple):
    """What is added to an identifier of lever.dbc."""

    shift: int = 0
    extended: bool = False
    """Identifiers have 29 bits."""

    @property
    def are_those_of_the_dbc(self) -> bool:
        """Whether no identifier is shifted or extended."""
        return self == Identifiers()


_chosen = Identifiers()


def add_identifier_options(parser: argparse.ArgumentParser, *aliases: str) -> None:
    """--id-offset and --id-base, which the command line makes the choice of the process; `aliases` of the former."""
    parser.set_defaults(prepare=use)
    either = parser.add_mutually_exclusive_group()
    either.add_argument(
        "--id-offset",
        *aliases,
        metavar="N",
        type=lambda text: _number(text, _MOST - _highest()),
        help="identifiers are higher by N than those in lever.dbc, as with lever_can --id-offset: 0x40, say",
    )
    either.add_argument(
        "--id-base",
        metavar="N",
        type=lambda text: _number(text, (1 << 29) - 1 - _MOST),
        help="identifiers have 29 bits, and are those in lever.dbc plus N: 0x18FF0000, say",
    )


def use(args: argparse.Namespace) -> None:
    """Make the choice of a command line the one of this process."""
    global _chosen
    offset, base = getattr(args, "id_offset", None), getattr(args, "id_base", None)
    _chosen = Identifiers(offset or 0) if base is None else Identifiers(base, extended=True)


def chosen() -> Identifiers:
    """Return how this process shifts identifiers."""
    return _chosen


def to_bus(identifier: int) -> tuple[int, bool]:
    """Return the identifier of a message on the bus, and whether it has 29 bits."""
    return identifier + _chosen.shift, _chosen.extended


def word(identifier: int) -> int:
    """to_bus() in one number, as in a DBC: bit 31 says 29 bits."""
    return identifier + _chosen.shift + (_EXTENDED if _chosen.extended else 0)


def from_bus(identifier: int, extended: bool) -> tuple[int, bool]:
    """Return the other way."""
    ours = identifier - _chosen.shift
    if _chosen.are_those_of_the_dbc or (extended == _chosen.extended and 0 <= ours <= _MOST):
        return ours, extended and _chosen.are_those_of_the_dbc
    return identifier | _FOREIGN, True


def translate(frames: Frames) -> Frames:
    """Return frames of a log, in place."""
    import numpy as np

    from .bulk import EXTENDED

    if not _chosen.are_those_of_the_dbc and len(frames):
        extended = frames["flags"] & EXTENDED != 0
        shifted = frames["id"].astype(np.int64) - _chosen.shift
        ours = (extended == _chosen.extended) & (shifted >= 0) & (shifted <= _MOST)
        frames["id"] = np.where(ours, shifted, frames["id"] | _FOREIGN)
        frames["flags"] = np.where(ours, frames["flags"] & ~np.uint8(EXTENDED), frames["flags"] | EXTENDED)
    return frames


def translate_bus(bus: can.BusABC) -> can.BusABC:
    """Return a bus that takes and gives the identifiers of lever.dbc, where it has others; it stays of its class."""
    if _chosen.are_those_of_the_dbc:
        return bus
    receive, send = bus.recv, bus.send

    def recv(timeout: float | None = None) -> can.Message | None:
        message = receive(timeout)
        if message is not None and not message.is_error_frame:
            message.arbitration_id, message.is_extended_id = from_bus(message.arbitration_id, message.is_extended_id)
        return message

    def send_shifted(msg: can.Message, timeout: float | None = None) -> None:
        identifier, extended = to_bus(msg.arbitration_id)
        shifted = type(msg)(
            arbitration_id=identifier, is_extended_id=extended, data=msg.data, is_remote_frame=msg.is_remote_frame
        )
        send(shifted, timeout)

    vars(bus).update(recv=recv, send=send_shifted)
    return bus


def shifted_dbc(text: str) -> str:
    """Return the text of a DBC with its identifiers as they are on the bus."""
    return re.sub(
        r"^((?:CM_ |BA_ \"\w+\" )?(?:BO_|SG_|VAL_|SG_MUL_VAL_|BO_TX_BU_) )(\d+)\b",
        lambda found: f"{found[1]}{word(int(found[2]))}",
        text,
        flags=re.MULTILINE,
    )


def _highest() -> int:
    from .codec import database

    return max(message.frame_id for message in database().messages)


def _number(text: str, most: int) -> int:
    try:
        number = int(text, 0)
    except ValueError:
        number = -1
    if not 0 <= number <= most:
        raise argparse.ArgumentTypeError(f"{text!r} must be a number from 0 to {most:#x}, such as 0x40")
    return number
