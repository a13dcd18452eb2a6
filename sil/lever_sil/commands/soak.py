"""`lever soak`."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.cli.layout import say
from lever_cdkf.cli.progress import Progress
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import check_writable
from lever_cdkf.text.counts import counted

from .names import seed
from .results import write_results

if TYPE_CHECKING:
    from ..soak.soak import SoakResult

_DESCRIPTION = """\
Flies one instance of the firmware for hours, without a reset: flights of five minutes one after another, each with a
pilot drawn at random who drifts, moves the lever, takes another grip and sometimes lets go, and with three random
faults of sensors and frames. Samples go in by structs, as fast as the processor does it; the 32 bits of their time
wrap.

For each hour: of the time later than 15 s after a start or grip, the share with a flag that says "do not trust this";
of the rest the mean NEES of the three parameters (expected 1), the mean NIS (expected 1), the share for which 2 sigma
holds the truth, and the seconds in which something was beyond 3 sigma for longer than a second without a flag. Then the
firmware's counts, and the memory of the process.

Exit status: 0; 1 when an estimate was not finite, the estimator was in fault, or memory grew; 2 when the command line
is wrong.
"""
_EPILOG = """\
examples:
  lever soak --hours 0.5                      some seconds
  lever soak --json soak.json -o soak.html    a day: a minute or two
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever soak`."""
    parser = subparsers.add_parser(
        "soak", help="simulate a day of flights without a reset", description=_DESCRIPTION, epilog=_EPILOG
    )
    parser.add_argument(
        "--hours", type=float, default=24.0, metavar="H", help="rounded to whole flights of 5 minutes (default: 24)"
    )
    parser.add_argument("--seed", type=seed, default=1, help="of all random numbers (default: 1)")
    parser.add_argument("-o", "--out", metavar="FILE", type=Path, help="also write a page with charts over the hours")
    parser.add_argument("--json", metavar="FILE", help='also write the hours to FILE: {"hours": [{"hour", …}], …}')
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """`lever soak`."""
    from lever_cdkf.cli.tables import print_tables

    from ..soak import soak, soak_page

    if args.out is not None:
        require("report")
        check_writable(args.out)
    if not (math.isfinite(args.hours) and 0.0 < args.hours <= 1000.0):
        raise LeverError(f"--hours {args.hours:g}: must be above 0, and at most 1000")
    with Progress("soak") as progress:
        result = soak.run(args.hours, args.seed, progress.show)
    hours = [{"hour": i + 1, **part.sums.row(), "memory [MiB]": part.memory} for i, part in enumerate(result.parts)]
    total = {"hour": "all", **result.total.row(), "memory [MiB]": result.parts[-1].memory}
    print_tables({"hours": [*hours, total]})
    say(verdict := _verdict(result))
    troubles = result.troubles()
    sums = {"hours": hours, "total": total, "memory_growth_mib": result.growth}
    sums |= {"faults": dict(sorted(result.faults.items())), "troubles": troubles}
    write_results(args.out, lambda: soak_page.build(result, [*hours, total], verdict), args.json, sums)
    if troubles:
        print(f"lever: soak: {'; '.join(troubles)}", file=sys.stderr)
    return 1 if troubles else 0


def _verdict(result: SoakResult) -> str:
    total, faults = result.total, sum(result.faults.values())
    return (
        f"{counted(total.row()['flights'], 'flight')} of 5 min with {faults} faults: NEES "
        f"{total.row()['NEES (expected 1)']:.2f} (expected 1), "
        f"silent errors for {total.silent_s:.0f} s, {total.counts['recoveries']} restarts of the filter, memory "
        f"{result.growth:+.1f} MiB."
    )
