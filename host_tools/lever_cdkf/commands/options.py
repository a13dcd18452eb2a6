"""Options that several commands have: settings, aircraft, and how samples are made of logs with other messages."""

from __future__ import annotations

import argparse
import importlib.metadata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import LeverError

if TYPE_CHECKING:
    from ..firmware.aircraft import AircraftResponse
    from ..firmware.settings_file import Assignments
    from ..signals.reading import Reading

AIRCRAFT = "lever_cdkf.aircraft"
"""Entry point group with one function, which makes the response of an aircraft by its name and what is changed."""
_OF_PACKAGE = (".toml", ".csv")
"""Endings of the files that it reads."""
MAP_HELP = """\
Signals of other messages: --dbc FILE describes them, and --map says which is what.
  --map theta=LEVER.Angle z_ddot=IMU.AccZ tau_m=MOTOR.Torque
The inputs are theta, theta_dot, z_ddot, tau_m and grip_force; z_ddot and one of theta and theta_dot are needed. In a
file of columns (.csv, .parquet, .mat, .npz, .mf4 with signals) a column is mapped, without --dbc; time=COLUMN names the
column of time, where it has another name; time=COLUMN,unit=ms says its unit, too. The unit is that of the database or
the header; where there is none, it is guessed, and the guess is printed. Gravity is recognised and subtracted. To set
these by hand, append to SIGNAL
,unit=deg ,factor=0.01 ,offset=-2 deg ,sign=-1 ,gravity=included (or none) ,delay=4 ms ,channel=can1 (in quotes, if it
has a blank). Instead of KEY=SIGNAL, a .toml file may hold the same, and how messages are protected (E2E); `lever map`
proposes one.
"""


def add_setting_options(parser: argparse.ArgumentParser) -> None:
    """Add --settings and --set."""
    parser.add_argument("--settings", metavar="FILE", help="start from the values in a settings file")
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="set one value; may be repeated, the last counts, and all take precedence over --settings",
    )


def chosen_assignments(args: argparse.Namespace) -> Assignments:
    """Return what they set, and a choice that has an option of its own, such as --model; raise SettingsError."""
    from ..firmware.config import CHOICES
    from ..firmware.settings_file import parse_assignment, read_assignments

    assignments = read_assignments(args.settings) if args.settings is not None else {}
    choices = {what: chosen for what in CHOICES if (chosen := getattr(args, what, None)) is not None}
    texts = [*args.set, *(f"{what}={chosen}" for what, chosen in choices.items())]
    return assignments | dict(map(parse_assignment, texts))


def add_signal_options(parser: argparse.ArgumentParser, *, part: bool = True) -> None:
    """--dbc, --map, --clock, and with `part` --start and --length."""
    options = parser.add_argument_group("signals of other logs and files")
    options.add_argument("--dbc", metavar="FILE", help="database of the messages (DBC, ARXML, KCD, SYM)")
    options.add_argument(
        "--map",
        metavar="KEY=SIGNAL",
        nargs="+",
        action="extend",
        default=[],
        help="input of the firmware = MESSAGE.SIGNAL, or a column; or a .toml file with the mapping",
    )
    options.add_argument(
        "--clock",
        metavar="KEY",
        help="the input whose values make the samples (default: the slowest of z_ddot and tau_m)",
    )
    if part:
        add_part_options(parser)


def add_part_options(parser: argparse.ArgumentParser, length: float | None = None) -> None:
    """--start and --length, by default `length` [s], or all."""
    usual = "all" if length is None else f"{length:g}"
    parser.add_argument("--start", metavar="S", type=float, default=0.0, help="first second used (default: 0)")
    parser.add_argument("--length", metavar="S", type=float, default=length, help=f"seconds used (default: {usual})")


def check_part(args: argparse.Namespace) -> tuple[float, float]:
    """Start and length. Raise LeverError."""
    length = float("inf") if args.length is None else args.length
    if not args.start >= 0.0 or not length > 0.0:
        raise LeverError(f"--start {args.start:g} --length {length:g}: seconds, and length must be more than 0")
    return args.start, length


def reading_words(args: argparse.Namespace, logs: Sequence[str], mapping: Sequence[str]) -> list[str]:
    """Return logs and how they are read, as arguments of another command; `mapping` in the place of --map."""
    options = {
        "--dbc": args.dbc,
        "--channel": args.channel,
        "--clock": args.clock,
        "--id-offset": args.id_offset,
        "--id-base": args.id_base,
    }
    return [*logs, *option_words(options), *(["--map", *mapping] if mapping else [])]


def option_words(options: Mapping[str, object]) -> list[str]:
    """Return options with their values, as arguments; those that are None are left out."""
    return [word for option, value in options.items() if value is not None for word in (option, str(value))]


def input_files(args: argparse.Namespace) -> list[str]:
    """Return the files that the options name: settings, database, mappings, aircraft."""
    aircraft = getattr(args, "aircraft", None) or ""
    of_aircraft = [each for each in (aircraft, aircraft.partition(",")[0]) if each and Path(each).is_file()]
    named = [getattr(args, "settings", None), args.dbc, *of_aircraft]
    return [path for path in named if path is not None] + [each for each in args.map if each.lower().endswith(".toml")]


def add_aircraft_option(parser: argparse.ArgumentParser, when: str = "") -> None:
    """--aircraft; `when` says with what it goes."""
    parser.add_argument(
        "--aircraft",
        metavar="AIRCRAFT",
        help=f"{when}watch the margin to collective bounce with this helicopter: one of `lever aircraft`, changed by "
        ",KEY=VALUE as there, or a file that it writes",
    )


def chosen_aircraft(args: argparse.Namespace) -> AircraftResponse | None:
    """Return the response in a file, or of NAME[,KEY=VALUE…] by the package that knows aircraft; raise LeverError.

    NAME may also be a file that the package reads.
    """
    from ..firmware.aircraft import read_response

    text = args.aircraft
    if text is None:
        return None
    if Path(text).is_file() and not text.lower().endswith(_OF_PACKAGE):
        return read_response(text)
    name, *changes = text.split(",")
    entries = sorted(importlib.metadata.entry_points(group=AIRCRAFT))
    is_path = Path(name).suffix != "" or Path(name).name != name or Path(name).exists()
    if entries and (not is_path or name.lower().endswith(_OF_PACKAGE)):
        response: AircraftResponse = entries[0].load()(name, changes)
        return response
    if changes:
        raise LeverError(
            f"--aircraft {text}: {name} is a response, with gearing, limits and all: change it in the file"
        )
    return read_response(name)


def chosen_reading(args: argparse.Namespace, log: str) -> Reading:
    """Return how `log` is to be read. Raise LeverError."""
    from ..signals.mapping import read_mapping
    from ..signals.reading import Reading

    start, length = check_part(args)
    if not (args.map or args.dbc):
        from ..signals.tables import is_table

        if log == "-" or not is_table(log):
            if args.clock is not None:
                raise LeverError("--clock goes with --map")
            return Reading(channel=args.channel, start=start, length=length, is_of_lever_dbc=True)
    mapping = read_mapping(args.map) if args.map else None
    return Reading(mapping, args.dbc, args.channel, args.clock, start, length)
