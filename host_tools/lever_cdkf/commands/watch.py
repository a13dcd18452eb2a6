"""`lever monitor` and `lever live`."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from ..can.buses import add_bus_options, add_duration_option, check_others_can_be_heard, chosen_options
from ..cli.layout import warn
from ..errors import LeverError
from ..runtime.extras import require
from . import options

if TYPE_CHECKING:
    from ..firmware.config import Config
    from ..watch.sources import Source

_MONITOR = f"""\
Shows the estimator on a CAN bus in the terminal, ten times a second: its parameters with standard deviation and trend,
natural frequency and damping ratio, mode and faults in words, and of each message the rate and what was lost or corrupt
by its E2E counter and CRC. It listens and sends nothing, and receives in a thread of its own, so that the bus never
waits for the terminal. Works over ssh and from 80 by 24 characters on.

Instead of a bus, LOG is played at the pace it was recorded at, or the pilot of --scenario is simulated in real time.

A bus or log without an estimator, with other messages: the firmware in this process estimates from mapped signals. On a
bus these are looked at for two seconds first.

{options.MAP_HELP}"""
_MONITOR_EPILOG = """\
keys: q quits, space holds the picture, t changes the time span of the trends, f shows or hides the feedthrough (shown
from 32 lines on), c clears the counts

examples:
  lever monitor --interface socketcan --channel can0
  lever monitor --interface slcan --channel /dev/ttyACM0
  lever monitor --scenario demo
  lever monitor session.log
  lever monitor flight.blf --dbc aircraft.dbc --map aircraft.toml
  lever monitor session.log --once                   the picture at the end of the log, as text
  lever monitor --interface socketcan --channel can0 --once --duration 5
"""
_LIVE = """\
Serves a web page that shows the estimator while it runs: the Bode diagram of its model as it changes, the parameters
with their bands over time, health and message rates, and controls to run, freeze and reset it, to shake it with dither
and to choose its model. The page comes from this computer alone, and works on a phone as well.

Only this computer can open it unless --host says otherwise. There is no password: whoever can reach the port can send
COMMAND frames (E2E protects against faults, not people), so give --read-only with --host, or use a tunnel:
  ssh -L 8642:localhost:8642 THE_OTHER_COMPUTER

A bus or log with other messages is mapped by --dbc and --map (see `lever monitor --help`); the firmware in this process
estimates from it.
"""
_LIVE_EPILOG = """\
examples:
  lever live --scenario demo                         then open http://127.0.0.1:8642/
  lever live --interface socketcan --channel can0 --read-only
  lever live session.log --port 0                    any free port
  lever live --interface socketcan --channel can0 --dbc aircraft.dbc --map aircraft.toml

Ctrl-C ends it.
"""
PORT = 8642


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parsers of `lever monitor` and `lever live`."""
    monitor = subparsers.add_parser(
        "monitor", help="watch the estimator in the terminal", description=_MONITOR, epilog=_MONITOR_EPILOG
    )
    _add_source(monitor)
    monitor.add_argument("--once", action="store_true", help="print one picture as plain text and end")
    add_duration_option(monitor, "never; with --once: listen for 2 s")
    monitor.set_defaults(run=run_monitor)
    live = subparsers.add_parser(
        "live", help="watch and control the estimator in a browser", description=_LIVE, epilog=_LIVE_EPILOG
    )
    _add_source(live)
    live.add_argument("--settings", metavar="FILE", help="the estimator's settings file, for the lever's geometry")
    live.add_argument("--host", default="127.0.0.1", help="address to listen at (default: %(default)s, this computer)")
    live.add_argument("--port", type=_port, default=PORT, help="default: %(default)s; 0 takes any that is free")
    live.add_argument("--read-only", action="store_true", help="without controls: no frame is ever sent")
    add_duration_option(live, "never")
    live.set_defaults(run=run_live)


def _add_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log",
        nargs="?",
        metavar="LOG",
        help="a recorded log that python-can reads; with --channel, only the frames of that bus",
    )
    parser.add_argument("--scenario", metavar="NAME", help="simulate a scenario of `lever sim --list` or a .toml file")
    add_bus_options(parser)
    options.add_signal_options(parser)
    options.add_aircraft_option(parser, "with mapped signals: ")


def run_monitor(args: argparse.Namespace) -> int:
    """`lever monitor`."""
    if not args.once:
        require("live")
    if not args.once and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise LeverError("this is not a terminal: `lever monitor --once` prints one picture as text")
    source = _source(args)[0]

    if args.once:
        from ..watch.once import print_once

        print_once(source, 2.0 if args.duration is None else args.duration)
    else:
        from ..watch.terminal import Monitor

        Monitor(source, args.duration).run()
    return _ended(source)


def run_live(args: argparse.Namespace) -> int:
    """`lever live`."""
    require("live")
    source, config = _source(args)

    from ..watch.server import serve

    serve(source, config, host=args.host, port=args.port, read_only=args.read_only, duration=args.duration)
    return _ended(source)


def _ended(source: Source) -> int:
    """Warn of what was wrong with a source; return the exit status. Raise LeverError when it has failed."""
    if source.warning is not None:
        warn(source.warning)
    source.check()
    return 0


def _source(args: argparse.Namespace) -> tuple[Source, Config]:
    """Return what is to be watched, and the configuration of the estimator as far as it is known here."""
    from ..firmware.config import Config

    given = [name for name in ("log", "scenario", "interface") if getattr(args, name) is not None]
    if len(given) != 1:
        what = "nothing to watch" if not given else f"{' and '.join(given)} at once"
        raise LeverError(f"{what}: give a LOG, --scenario NAME, or --interface and --channel of a bus, one of them")
    settings = getattr(args, "settings", None)
    aircraft = options.chosen_aircraft(args)
    if args.scenario is not None:
        from ..watch.sources import simulated

        if settings is not None:
            raise LeverError("--settings goes with a bus or a log; a scenario has its own settings")
        if args.map or args.dbc or aircraft is not None:
            raise LeverError("--dbc, --map and --aircraft go with a bus or a log; a scenario speaks lever.dbc")
        return simulated(args.scenario)

    from ..firmware.settings_file import make_config, read_assignments
    from ..watch.sources import BusSource, LogSource

    config = Config() if settings is None else make_config(read_assignments(settings))
    reading = None if args.log is None else options.chosen_reading(args, args.log)
    if reading is not None and not reading.is_of_lever_dbc:
        from ..watch.mapped import MappedLogSource

        return MappedLogSource(args.log, reading, config, aircraft), config
    if args.map or args.dbc:
        from ..signals.mapping import read_mapping
        from ..signals.online import Online
        from ..watch.mapped import MappedBusSource

        if not (args.map and args.dbc):
            raise LeverError("a bus needs both --dbc FILE and --map KEY=MESSAGE.SIGNAL")
        online = Online(read_mapping(args.map), args.dbc, args.clock)
        check_others_can_be_heard(args.interface)
        of_bus = chosen_options(args, fd=online.fd)
        return MappedBusSource(args.interface, args.channel, online, config, of_bus, aircraft), config
    if aircraft is not None:
        raise LeverError("--aircraft goes with --map: an estimator on the bus has its own (`lever_can --aircraft`)")
    if reading is not None:
        return LogSource(args.log, reading.channel, part=(reading.start, reading.length)), config
    check_others_can_be_heard(args.interface)
    return BusSource(args.interface, args.channel, chosen_options(args)), config


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port from 0 to 65535")
    return int(text)
