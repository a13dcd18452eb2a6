"""`lever dbc`: the CAN messages."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..can.identifiers import add_identifier_options, chosen, shifted_dbc, word
from ..cli.layout import say
from ..cli.tables import Row, add_json_option
from ..errors import LeverError

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

_DESCRIPTION = """\
Prints the CAN messages and their signals: classic CAN, 11-bit identifiers, 1 Mbit/s, little-endian. A physical value is
the whole number in the frame times the step, unless that number is named not_available. Byte 0 and the low half of byte
1 are the CRC and counter of AUTOSAR E2E Profile 2, whose data ID is the message's base plus the counter.
"""
_EPILOG = """\
examples:
  lever dbc
  lever dbc --path                                        where the DBC is, for other tools:
  candump -L vcan0 | cantools decode "$(lever dbc --path)"
  lever dbc --wireshark ~/.config/wireshark/profiles/lever
  lever dbc --offset 0x40 --text > second.dbc             of a second lever: lever_can --id-offset 0x40
  candump -L vcan0 > flight.log; wireshark -C lever flight.log
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever dbc`."""
    parser = subparsers.add_parser(
        "dbc",
        help="the CAN messages and signals, with units",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    output = parser.add_mutually_exclusive_group()
    output.add_argument("--path", action="store_true", help="print only the path of the installed lever.dbc")
    output.add_argument(
        "--wireshark",
        metavar="DIR",
        type=Path,
        help="write all signals as a Wireshark profile into the folder DIR (Wireshark reads no DBC)",
    )
    output.add_argument("--text", action="store_true", help="print the DBC itself, with the identifiers of --offset")
    add_json_option(output)
    add_identifier_options(parser, "--offset")


def run(args: argparse.Namespace) -> int:
    """Run `lever dbc`; return the exit status."""
    from ..cli.tables import print_tables
    from ..runtime.files import native_file

    if args.text:
        print(shifted_dbc(native_file("lever.dbc").read_text(encoding="utf-8")), end="")
        return 0
    if args.path:
        if not chosen().are_those_of_the_dbc:
            raise LeverError("the installed lever.dbc has identifiers of its own: print another with --text")
        print(native_file("lever.dbc"))
        return 0
    if args.wireshark is not None:
        from ..can.wireshark import write_profile

        write_profile(args.wireshark)
        say(f"Written to {args.wireshark}: for wireshark -C {args.wireshark.name} if that is where its profiles are")
        return 0

    from ..can.codec import database

    messages = database().messages
    signals = [_signal_row(message, signal) for message in messages for signal in message.signals]
    print_tables({"messages": [_message_row(message) for message in messages], "signals": signals}, args.json, digits=6)
    return 0


def _message_row(message: Message) -> Row:
    from ..can.codec import data_ids

    return {
        "message": message.name,
        "id": f"{word(message.frame_id) & 0x1FFFFFFF:#05x}",
        "bytes": message.length,
        "sender": ", ".join(message.senders),
        "data ID base": data_ids(message.name)[0],
        "meaning": message.comment,
    }


def _signal_row(message: Message, signal: Signal) -> Row:
    choices = ", ".join(f"{raw} {name}" for raw, name in sorted((signal.choices or {}).items()))
    return {
        "message": message.name,
        "signal": signal.name,
        "first bit": signal.start,
        "bits": signal.length,
        "signed": signal.is_signed,
        "step": float(signal.scale),
        "unit": signal.unit,
        "least": signal.minimum,
        "greatest": signal.maximum,
        "meaning": " ".join(part for part in (signal.comment, choices) if part),
    }
