"""The option --format of commands that write the signals of a run, by exports/. Log formats are read by can/logs.py."""

from __future__ import annotations

import argparse

from ..errors import LeverError
from ..runtime.extras import missing, require
from .layout import warn

FORMATS = {"csv": "trace.csv", "mf4": "signals.mf4", "mcap": "signals.mcap", "parquet": "trace.parquet"}
"""And their files."""
_EXTRAS = {"mf4": ("mf4",), "mcap": ("files", "mcap"), "parquet": ("files", "pyarrow")}
"""The extra that a format needs, and the one package of it that is enough, if there is one."""
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
    if reason := missing("report"):
        warn(f"no report.html: {reason}")
    chosen: tuple[str, ...] = args.format or (_DEFAULT,)
    for name in chosen:
        if name in _EXTRAS:
            require(*_EXTRAS[name])
    return chosen


def _formats(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(FORMATS)}")
    return names
