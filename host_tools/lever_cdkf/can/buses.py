"""Buses that are named on a command line: the options for it, and python-can's bus from them."""

from __future__ import annotations

import argparse
import importlib.util
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from ..errors import LeverError
from ..runtime.extras import pip_install
from ..text.suggestions import did_you_mean
from .identifiers import add_identifier_options, translate_bus

if TYPE_CHECKING:
    import can

_DEFAULTS: Mapping[str, Mapping[str, Any]] = {"slcan": {"bitrate": 1_000_000, "sleep_after_open": 0.0}}
"""Unless told otherwise: the bit rate of lever.dbc, and no two seconds for an Arduino to reset in."""
_IN_PROCESS = ("lever", "virtual")
_PACKAGES = {"udp_multicast": "msgpack", "gs_usb": "gs_usb"}
"""That an interface imports and python-can does not bring along."""
_ROOM = 1 << 26
"""[byte] for frames that wait: about 20 s of a full bus of 1 Mbit/s."""
_SO_RCVBUFFORCE = 33  # <asm-generic/socket.h>; the module socket does not have it


def add_bus_options(parser: argparse.ArgumentParser) -> None:
    """--interface, --channel and others, with those of identifiers.py, for open_bus() and chosen_options()."""
    parser.add_argument("--interface", help="of python-can: socketcan, slcan, pcan, kvaser …")
    parser.add_argument("--channel", help="can0, /dev/ttyACM0, … as the interface calls it")
    parser.add_argument("--bitrate", metavar="RATE", type=int, help="[bit/s] for interfaces that set it")
    parser.add_argument(
        "--bus-option",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="more for the interface, such as tty_baudrate=921600 for slcan; may be repeated",
    )
    add_identifier_options(parser)


def add_duration_option(parser: argparse.ArgumentParser, otherwise: str) -> None:
    """--duration [s]; `otherwise` says when the command ends without it."""
    parser.add_argument(
        "--duration", metavar="SECONDS", type=_seconds, help=f"end after so long (default: {otherwise})"
    )


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 < value < 1e9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds above 0")
    return value


def chosen_options(args: argparse.Namespace, *, fd: bool = False) -> dict[str, Any]:
    """Return options for open_bus(), numbers and truth values as such; raise LeverError.

    With `fd` they are of a bus with CAN FD, which other interfaces than SocketCAN need more options for.
    """
    from can.util import cast_from_string

    options: dict[str, Any] = {"fd": True} if fd and args.interface == "socketcan" else {}
    for assignment in args.bus_option:
        key, equals, value = assignment.partition("=")
        if not (key and equals):
            raise LeverError(f"--bus-option {assignment}: must be KEY=VALUE, such as tty_baudrate=921600")
        options[key] = cast_from_string(value)
    return options if args.bitrate is None else options | {"bitrate": args.bitrate}


def check_others_can_be_heard(interface: str) -> None:
    """Raise LeverError for an interface that stays inside this process."""
    if interface in _IN_PROCESS:
        raise LeverError(
            f"interface {interface} stays inside one process, so there is nothing else to receive: give a bus such as "
            "--interface socketcan --channel vcan0"
        )


def open_bus(interface: str, channel: str | None, options: Mapping[str, Any], *, translated: bool = True) -> can.BusABC:
    """Return a python-can bus; raise LeverError.

    `translated`: with the identifiers of lever.dbc, whatever they are on it.
    """
    import can

    from .protocol_ahead import read_ahead

    if interface not in can.VALID_INTERFACES:
        known = sorted(can.VALID_INTERFACES)
        hint = did_you_mean(interface, known, f"there are {', '.join(known)}")
        raise LeverError(f"no interface {interface!r}; {hint}")
    package = _PACKAGES.get(interface)
    if package is not None and importlib.util.find_spec(package) is None:
        raise LeverError(f"interface {interface} needs the Python package {package}: {pip_install(package)}")
    given = {**_DEFAULTS.get(interface, {}), **options}
    if channel is not None:
        given["channel"] = read_ahead(channel) if interface == "slcan" else channel
    where = interface if channel is None else f"{interface} channel {channel}"
    try:
        bus = can.Bus(interface=interface, **given)
    except Exception as error:  # without its driver, an interface may come up with any, NameError among them
        raise LeverError(f"cannot open {where}: {error}; is it there and up?") from None
    if bus.channel_info == can.BusABC.channel_info:  # slcan does not say what it is
        bus.channel_info = where
    return translate_bus(bus) if translated and interface != "lever" else bus


def make_room(bus: can.BusABC) -> None:
    """Let frames wait while this process has no turn: a socket holds but a tenth of a second otherwise."""
    opened = getattr(bus, "socket", None)
    if isinstance(opened, socket.socket):
        for option in (_SO_RCVBUFFORCE, socket.SO_RCVBUF):  # the first takes a privilege
            with suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, option, _ROOM)
                return
