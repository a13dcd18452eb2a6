"""`lever faults`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.cli.layout import say
from lever_cdkf.cli.progress import Progress
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import made_folder
from lever_cdkf.text.counts import counted

from .names import check_names
from .results import write_results

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..faults.rows import Row

_DESCRIPTION = """\
Flies each fault of bus, senders and sensors, and holds the firmware against what it must then do: frames with flipped
bits, wrong CRC, counter or length, lost, late, repeated or foreign ones; readings that are stuck, off or missing;
clocks that stand or jump; floods of COMMAND. Frames pass the firmware's E2E check, and its dither moves the lever. The
fault lasts from 15 to 25 s of 40 s.

A row holds when the flag shows in time, mode and torque are as demanded, the firmware learns again 2 s after the fault
and knows the natural frequency at the end. Besides, every estimate must be finite, every sample be answered, and torque
keep within the gate's limits. A row is SILENT when an estimate is off by more than 3 sigma for a second or more
without a flag. "right" is the share of samples without a flag that are within 3 sigma; it must be 99 %. A row is
"known" when it does not hold because of a known limitation. The page of -o has a chart of each row that does not hold,
and, where it is known, the reason.

Exit status: 0 when all rows hold but for known limitations, 1 when another one does not, 2 when the command line is
wrong.
"""
_EPILOG = """\
examples:
  lever faults --list
  lever faults --quick                        some faults, one pilot
  lever faults --only theta_stuck lever_crc --seeds 20
  lever faults -o out/faults                  all faults, three pilots each: half a minute
"""
_SEEDS, _QUICK_SEEDS = 3, 1


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever faults`."""
    parser = subparsers.add_parser(
        "faults",
        help="test the firmware with faults of bus, senders and sensors",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument("--list", action="store_true", help="print the faults and what they demand, and stop")
    parser.add_argument("--quick", action="store_true", help=f"some faults, {_QUICK_SEEDS} pilot each")
    parser.add_argument("--seeds", type=int, metavar="N", help=f"random pilots a fault (default: {_SEEDS})")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="faults of --list (default: all)")
    parser.add_argument(
        "-o", "--out", metavar="DIR", type=Path, help="folder for the page, faults.html (default: no files)"
    )
    parser.add_argument("--json", metavar="FILE", help='also write the rows to FILE: {"rows": [{"name", …}], …}')
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """`lever faults`."""
    from lever_cdkf.cli.tables import print_tables

    from ..faults import table
    from ..faults.rows import ROWS

    if args.list:
        listed = [
            {"fault": row.name, "title": row.title, "must": table.demands(row.requirement)} for row in ROWS.values()
        ]
        print_tables({"faults": listed}, args.json)
        return 0
    chosen = _chosen(args)
    seeds = args.seeds if args.seeds is not None else _QUICK_SEEDS if args.quick else _SEEDS
    if not 1 <= seeds <= 1000:
        raise LeverError(f"--seeds {seeds}: must be from 1 to 1000")
    if args.out is not None:
        require("report")
    with made_folder(args.out):
        return _run(chosen, seeds, args)


def _run(chosen: Sequence[Row], seeds: int, args: argparse.Namespace) -> int:
    """Fly the faults, print and write what came of them, and return the exit status."""
    from lever_cdkf.cli.tables import print_tables

    from ..faults import faults_page, matrix, table

    with Progress("faults") as progress:
        results = matrix.run(chosen, seeds, progress.show)
    print_tables({f"{counted(seeds, 'random pilot')} a fault, the worst of them": table.lines(results)})
    counts = table.counts(results)
    known = counts["missed"] - counts["unexpected"]
    said = f"{counts['count']} faults: {counts['missed']} not met as demanded ({counts['silent']} silent)"
    say(f"{said}; {known} of these are known limitations.")
    if unexpected := table.unexpected(results):
        say(f"Not known before: {', '.join(unexpected)}.")
    page = None if args.out is None else args.out / "faults.html"
    rows = {"rows": table.rows(results), **counts}
    write_results(page, lambda: faults_page.build(results, seeds), args.json, rows)
    return 1 if unexpected else 0


def _chosen(args: argparse.Namespace) -> list[Row]:
    """Return the rows that were asked for. Raise LeverError for one that is not known."""
    from ..faults.rows import ROWS

    check_names("fault", args.only or (), ROWS, "lever faults --list")
    if args.only:
        return [ROWS[name] for name in dict.fromkeys(args.only)]
    return [row for row in ROWS.values() if row.quick or not args.quick]
