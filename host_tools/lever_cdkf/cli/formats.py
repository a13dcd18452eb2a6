"""The option --format of commands that write the signals of a run, by exports/. Log formats are read by can/logs.py."""

from __future__ import annotations

import argparse

from ..errors import LeverError
from ..runtime.extras import require_for_file, warn_of_no_report

FORMATS = {"csv": "trace.csv", "mf4": "signals.mf4", "mcap": "signals.mcap", "parquet": "trace.parquet"}
"""And their files."""
_DEFAULT = "csv"


def add_format_option(parser: argparse.ArgumentParser) -> None:
    """Add --format."""
    parser.add_argument(
        "--format",
        metavar="LIST",
        type=_formats,
        help=f"formats of the signals, of {','.join(FORMATS)} (default: {_DEFAULT})",
    )


def chosen_formats(args: argparse.Namespace) -> tuple[str, ...]:
    """Return what --format says; raise LeverError for a format that needs an extra that is missing, and without --out.

    Say on standard error if the report needs an extra that is missing.
    """
    if args.out is None:
        if args.format is not None:
            raise LeverError("--format is for the files of --out: say where these go")
        return ()
    warn_of_no_report()
    chosen: tuple[str, ...] = args.format or (_DEFAULT,)
    for name in chosen:
        require_for_file(FORMATS[name])
    return chosen


def _formats(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(FORMATS)}")
    return names
