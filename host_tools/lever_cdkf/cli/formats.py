"""The option --format of commands that write the signals of a run, by exports/. Log formats are read by can/logs.py."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from ..errors import LeverError
from ..runtime.extras import missing_of_file, require_for_file, warn_of_left_out

FORMATS = {"csv": "trace.csv", "mf4": "signals.mf4", "mcap": "signals.mcap", "parquet": "trace.parquet"}
"""And their files."""


def add_format_option(parser: argparse.ArgumentParser, usual: Sequence[str]) -> None:
    """--format; `usual` are those without it, as far as their extras are installed."""
    parser.add_argument(
        "--format",
        metavar="LIST",
        type=_formats,
        help=f"formats of the signals, of {','.join(FORMATS)} (default: {','.join(usual)})",
    )
    parser.set_defaults(usual_formats=tuple(usual))


def chosen_formats(args: argparse.Namespace) -> tuple[str, ...]:
    """Return what --format says; raise LeverError for a format that needs an extra that is missing, and without --out.

    Without --format, say on standard error which of the usual files need an extra that is missing.
    """
    if args.out is None:
        if args.format is not None:
            raise LeverError("--format is for the files of --out: say where these go")
        return ()
    if args.format is None:
        files = [FORMATS[name] for name in args.usual_formats]
        warn_of_left_out([*files, "report.html"])
        return tuple(name for name in args.usual_formats if not missing_of_file(FORMATS[name]))
    warn_of_left_out(["report.html"])
    for name in args.format:
        require_for_file(FORMATS[name])
    chosen: tuple[str, ...] = args.format
    return chosen


def _formats(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(FORMATS)}")
    return names
