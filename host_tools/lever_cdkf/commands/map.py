"""`lever map`."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..cli import layout
from ..cli.tables import Row, add_json_option
from ..errors import LeverError
from ..runtime.files import check_not_input
from .options import add_part_options, check_part, option_words

if TYPE_CHECKING:
    from ..signals.mapping import Mapping
    from ..signals.proposal import Candidate
    from ..signals.recorded import Signal

_DESCRIPTION = """\
Looks at the signals of a log and proposes which of them are the firmware's inputs: the angle of the lever (theta), its
rate (theta_dot), the vertical acceleration of its base (z_ddot), the motor's torque (tau_m), the force of the hand
(grip_force). It goes by names, units and words of the database, and by the values: gravity in an acceleration, a rate
that is the slope of an angle. It may be wrong: look at the plots, and at the reasons.

LOG is a log of a bus, with its database (--dbc), or a file of columns: .csv, .parquet, .mat, .npz, .mf4 with signals.
The proposal is printed as the options of `lever replay` and `lever tune`; --toml writes it as a mapping file, to be
edited and given as --map FILE.toml.
"""
_EPILOG = """\
examples:
  lever map flight.blf --dbc aircraft.dbc
  lever map flight.blf --dbc aircraft.dbc --toml aircraft.toml -o signals.html
  lever map flight.csv --json proposal.json
"""
_LOOKED_AT = 60.0
_SPARK = 40


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever map`."""
    parser = subparsers.add_parser(
        "map", help="propose which signals of any log are the inputs", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument("log", metavar="LOG", help="a recorded log, or a file of columns")
    parser.add_argument("--dbc", metavar="FILE", help="database of the messages (DBC, ARXML, KCD, SYM)")
    parser.add_argument("--channel", metavar="NAME", help="the bus that is looked at (default: all)")
    parser.add_argument(
        "--time", metavar="COLUMN", help="the column of time of a file, with its unit: t,unit=ms (default: by its name)"
    )
    parser.add_argument("--toml", metavar="FILE", type=Path, help="write the proposal as a mapping file")
    parser.add_argument(
        "-o", "--out", metavar="FILE", type=Path, help="write plots of what changes: .html, .pdf, .svg, .png"
    )
    add_part_options(parser, _LOOKED_AT)
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run `lever map`; return the exit status."""
    from ..cli.tables import print_tables
    from ..runtime.files import write_text
    from ..runtime.provenance import provenance
    from ..signals.mapping import as_toml, time_column
    from ..signals.plots import KINDS, write
    from ..signals.proposal import propose
    from ..signals.reading import all_signals
    from ..signals.recorded import notes_of

    start, length = check_part(args)
    read = [args.log, *([args.dbc] if args.dbc else [])]
    if args.out is not None and args.out.suffix.lower() not in KINDS:
        raise LeverError(f"cannot write {args.out}: plots are {', '.join(KINDS)}; --toml FILE writes the mapping")
    for path in (args.toml, args.out, args.json):
        check_not_input(path, read)
    time = None if args.time is None else time_column(args.time)
    signals = all_signals(args.log, args.dbc, args.channel, time, start, length)
    mapping, proposed, nearly = propose(signals, args.log)
    if time is not None:
        mapping = replace(mapping, time=time[0], time_unit=time[1])
    inputs = {each.signal.name: each.key for each in proposed}
    others = [signal for signal in signals if signal.name not in inputs]
    changing = [signal for signal in others if signal.changes()]
    rows = [_row("", signal) for signal in changing]
    mapped: list[Row] = [{**_row(each.key, each.signal), "why": "; ".join(each.why)} for each in proposed]
    print_tables({"mapping": mapped, "other signals": rows}, args.json, inputs=read)
    for note in [*notes_of(signals), *_assumed(mapping, proposed), *map(_left_out, nearly)]:
        layout.say(f"{note}.")
    if len(changing) < len(others):
        layout.say(f"{len(others) - len(changing)} other signals never change, and are not shown.")
    signals_of = _signal_options(args, mapping, proposed)
    for command in (f"lever tune {signals_of} -o my.settings", f"lever replay {signals_of}"):
        print(*layout.command_lines(command, layout.terminal_width()), sep="\n")
    origin = provenance(read)
    if args.toml is not None:
        write_text(args.toml, origin.comment() + as_toml(mapping))
    if args.out is not None:
        shown = [(each.key, each.signal) for each in proposed]
        write(args.out, shown + [("", each) for each in changing], Path(args.log).name, origin)
    if written := [str(path) for path in (args.toml, args.out) if path is not None]:
        layout.say(f"Written: {', '.join(written)}")
    return 0


def _assumed(mapping: Mapping, proposed: list[Candidate]) -> list[str]:
    """Units that no signal states, for the user to check."""
    notes = []
    for each in proposed:
        unit = mapping.sources[each.key].unit
        if unit != each.signal.unit:
            notes.append(f"{each.key} = {each.signal.name} has no unit: {unit} is assumed ({each.why[-1]}); check it")
    return notes


def _left_out(each: Candidate) -> str:
    """Name a signal that may be an input, and how to take it."""
    from ..signals.units import KINDS

    name, unit = each.signal.name, each.signal.unit
    lacks = f"is in {unit}" if unit else "has no unit"
    given = "" if unit else f",unit={KINDS[each.key][1]}"
    option = f"`lever replay … --map '{each.key}={name}{given}'`"
    return f"{each.key} is not mapped: {name} {lacks}, and may be something else; {option} takes it"


def _row(key: str, signal: Signal) -> Row:
    import numpy as np

    from ..signals.plots import sparkline

    present = signal.values[np.isfinite(signal.values)]
    return {
        **({"input": key} if key else {}),
        "signal": signal.name,
        "unit": signal.unit,
        "rate [Hz]": float(f"{1.0 / signal.period:.4g}") if np.isfinite(signal.period) else None,
        "least": float(present.min()) if len(present) else None,
        "median": float(np.median(present)) if len(present) else None,
        "greatest": float(present.max()) if len(present) else None,
        "plot": sparkline(signal, _SPARK),
    }


def _signal_options(args: argparse.Namespace, mapping: Mapping, proposed: list[Candidate]) -> str:
    """Return the log and the proposal, as arguments of commands that read signals."""
    entries = []
    for each in proposed:
        source = mapping.sources[each.key]
        unit = f",unit={source.unit}" if source.unit != each.signal.unit else ""
        turned = ",sign=-1" if source.sign == -1 else ""
        entries.append(f"{each.key}={each.signal.name}{unit}{turned}")
    entries += [f"time={args.time}"] if args.time else []
    return shlex.join([args.log, *option_words({"--dbc": args.dbc}), "--map", *entries])
