"""`lever replay`."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..can.identifiers import add_identifier_options
from ..cli.formats import add_format_option, chosen_formats
from ..cli.layout import say, warn
from ..cli.tables import Row, Tables, add_json_option
from ..runtime.files import check_not_input, made_folder
from . import options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..replay.engine import Options
    from ..results.summary import ReplaySummary

_DESCRIPTION = f"""\
Feeds recorded CAN logs to the firmware in this process, in recorded order, and prints its estimates; with --out also
writes into DIR

  bus.log        frames to and from the estimator, in the format of candump, in recorded time
  trace.csv      measured, estimated, standard deviations and health, a row for each sample
  signals.mf4    with --format mf4: the same signals with units and comments, for asammdf, PlotJuggler and the like
  signals.mcap   with --format mcap: the same as messages, for Foxglove
  trace.parquet  with --format parquet: trace.csv with units, for pandas, polars and the like
  summary.json   estimates, innovations, what was found in the log, a verdict, and where the files come from
  report.html    all of it as one page for a browser

LOG is a log of candump -L (.log, or - for standard input), or .blf, .asc, .mf4, .trc, .csv or .db, compressed (.gz) or
not, or a file of columns (see below). Several logs are taken one after another in the order of their first frames, or
with --each as separate recordings. Other messages, other buses and damaged lines are counted and left out. If the log
also holds estimates, of the firmware that ran when it was recorded and by this version of lever.dbc (IDENTITY says so),
they are compared with the new ones, signal by signal.

{options.MAP_HELP}
The settings are the firmware's defaults, changed by --settings and --set; `lever tune` finds those of a log. COMMAND
frames in the log are obeyed, except for a choice (model, preload, estimator, adaptation, mitigation) that is made here.
Mapped signals set sample_period.
"""
_EPILOG = """\
examples:
  lever replay session.log
  lever replay session.log -o out/session
  lever replay session.log --model linear_physical --set theta_noise=0.002 -o out/other
  lever replay monday_1.log.gz monday_2.log.gz --channel can1 -o out/monday
  candump -L can0 | lever replay - -o out/live
  lever replay monday/*.blf --each --dbc aircraft.dbc --map aircraft.toml -o out/monday --json monday.json
  lever replay flight.blf --dbc aircraft.dbc --map theta=LEVER.Angle z_ddot=IMU.AccZ -o out/flight
  lever replay flight.csv --map theta=angle z_ddot=acc,unit=g -o out/flight

Exit status: 0 when the log was replayed, whatever the flags of the estimates say; 1 when the estimator was in mode
fault or published no estimate, with one line on standard error.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever replay`."""
    parser = subparsers.add_parser(
        "replay", help="run the firmware on recorded CAN logs", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument("logs", nargs="+", metavar="LOG", help="a recorded log; several are one recording in pieces")
    add_identifier_options(parser)
    parser.add_argument(
        "--each", action="store_true", help="every LOG is a separate recording: one table, one page, a row for each"
    )
    parser.add_argument("-o", "--out", metavar="DIR", type=Path, help="folder for the files (default: no files)")
    parser.add_argument(
        "--channel", metavar="NAME", help="the bus with the samples (default: the only one that has any)"
    )
    for what in ("model", "preload", "estimator", "adaptation", "mitigation"):
        parser.add_argument(f"--{what}", help=f"choose the {what}, whatever the log says (`lever settings` lists them)")
    options.add_setting_options(parser)
    options.add_aircraft_option(parser)
    options.add_signal_options(parser)
    add_format_option(parser)
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run `lever replay`; return the exit status."""
    from ..can.logs import incomplete
    from ..cli.progress import Progress
    from ..cli.tables import print_tables
    from ..replay.engine import replay
    from ..replay.outputs import FILES
    from ..replay.summary import failure

    check_not_input(args.json, args.logs)
    if args.each:
        return _run_each(args)
    asked = _options(args, args.logs[0], chosen_formats(args))
    with Progress("replay") as progress:
        summary = replay(args.logs, asked, args.out, progress.show)
    if summary.warning and args.json is None:
        say(f"{summary.warning}\n")
    print_tables(_tables(summary), args.json, inputs=[*args.logs, *options.input_files(args)])
    say(summary.verdict)
    if args.out is not None:
        say(f"Written to {args.out}: {', '.join(name for name in FILES if (args.out / name).exists())}")
    if said := incomplete(summary.recording.ends_early):
        warn(said)
    if not summary.passed:
        print(f"lever: replay: {failure(summary)}", file=sys.stderr)
    return 0 if summary.passed else 1


def _run_each(args: argparse.Namespace) -> int:
    from ..cli.progress import Progress
    from ..cli.tables import print_tables
    from ..firmware.settings_file import make_config
    from ..replay.each import replay_each, rows_of, write
    from ..signals.mapping import read_mapping

    make_config(options.chosen_assignments(args))  # what is wrong with the command line is wrong for all
    if args.map:
        read_mapping(args.map)
    options.check_part(args)
    formats = chosen_formats(args)
    with made_folder(args.out):
        with Progress("replay") as progress:
            replays = replay_each(args.logs, lambda log: _options(args, log, formats), args.out, progress.show)
        print_tables({"logs": rows_of(replays)}, args.json, inputs=[*args.logs, *options.input_files(args)])
        if args.out is not None:
            written = write(replays, args.out, options.input_files(args))
            say(f"Written to {args.out}: {', '.join([*written, 'a folder for each log'])}")
    for each in replays:
        if each.problem:
            print(f"lever: replay: {each.log}: {each.problem.removeprefix(f'{each.log}: ')}", file=sys.stderr)
    return 1 if any(each.failed for each in replays) else 0


def _options(args: argparse.Namespace, log: str, formats: Sequence[str]) -> Options:
    from ..firmware.config import CHOICES
    from ..firmware.settings_file import make_config
    from ..replay.engine import Options

    assignments = options.chosen_assignments(args)
    chosen_here = {what: str(name) for what, name in assignments.items() if what in CHOICES}
    return Options(
        *(make_config(assignments), chosen_here, options.chosen_reading(args, log)),
        formats=formats,
        aircraft=options.chosen_aircraft(args),
        inputs=options.input_files(args),
        tune_command=_tune_command(args, log),
    )


def _tune_command(args: argparse.Namespace, log: str) -> str:
    """Return how `lever tune` reads the same."""
    given = {
        "--settings": args.settings,
        "--start": f"{args.start:g}" if args.start else None,
        "--length": None if args.length is None else f"{args.length:g}",
        "-o": "my.settings",
    }
    logs = [log] if args.each else args.logs
    return shlex.join(["lever", "tune", *options.reading_words(args, logs, args.map), *options.option_words(given)])


def _tables(summary: ReplaySummary) -> Tables:
    estimates: list[Row] = [
        {
            "quantity": name,
            "unit": entry.unit,
            "at end": entry.last,
            "sigma": entry.last_sigma,
            "least": entry.least,
            "greatest": entry.greatest,
        }
        for name, entry in summary.estimates.items()
    ]
    tables: dict[str, list[Row]] = {"estimates": estimates}
    if summary.comparison is not None:
        tables["replayed minus recorded estimates"] = [*summary.comparison.rows()]
    if mapping := summary.recording.mapping:
        rows: list[Row] = [{"input": key, **vars(each)} for key, each in mapping.inputs.items()]
        times: list[Row] = [{"input": "time", "signal": name, "unit": unit} for name, unit in mapping.times.items()]
        tables["signals"] = [{**dict.fromkeys(rows[0]), **row} for row in (*times, *rows)]
    shares = {**summary.fault_shares, "any that warns": summary.flagged_share}
    judged = "time" if summary.flagged_share is None else "judged time"
    tables[f"share of the {judged} with each fault"] = [
        {"fault": name, "share [%]": None if share is None else 100.0 * share} for name, share in shares.items()
    ]
    return tables | {"recording": [_recording_row(summary)]}


def _recording_row(summary: ReplaySummary) -> Row:
    recording = summary.recording
    left_out = ", ".join(f"{count} {kind}" for kind, count in recording.frames_left_out.items())
    return {
        "bus": recording.channel,
        "duration [s]": recording.duration_s,
        "frames": recording.frames,
        "frames left out": left_out or "none",
        "refused": recording.refused,
        "samples": summary.samples,
        "lost": summary.lost,
        "corrupt or implausible": summary.corrupt,
        "late": summary.late,
        "restarts": summary.restarts,
        "repeated frames": recording.repeated,
        "damaged lines": recording.damaged_lines,
        "gaps": recording.gaps,
        "longest gap [s]": recording.longest_gap_s,
        "mean NIS [1]": summary.nis.mean,
    }
