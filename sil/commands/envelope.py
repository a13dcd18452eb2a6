"""`lever envelope`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.host_tools.errors import LeverError
from lever_cdkf.host_tools.extras import require
from lever_cdkf.host_tools.files import make_folder, write_text
from lever_cdkf.host_tools.layout import say
from lever_cdkf.host_tools.progress import Progress

from .names import check_names

if TYPE_CHECKING:
    from ..envelope.campaign import Result
    from ..envelope.condition import Condition

_DESCRIPTION = """\
Runs the firmware in the conditions that a collective meets: a pilot who moves the lever, lets go or tightens the grip,
unknown torque, rest, sensors that fail or are off, friction, pilots that no model can represent. Levers and pilots are
simulated by a plant that shares nothing with the filter's model; samples go straight into the firmware, with its
default settings.

A condition holds when the natural frequency (f_n), damping ratio (zeta) and parameters are right within the limit, when
the stated ±2σ covers the truth as often as the limit asks, or, where the limit says so, when the firmware flags that
it is not to be trusted. "all runs" pools them (rms of errors, mean of shares, the longest time); a limit
applies to that unless it says median or worst. The page that is written has a chart and all figures of each condition.

Exit status: 0 when all conditions hold, 1 when one misses, 2 when the command line is wrong.
"""
_EPILOG = """\
examples:
  lever envelope --list
  lever envelope --quick                          some conditions, three pilots each: ten seconds
  lever envelope --only retrim base_stuck --seeds 50
  lever envelope --json envelope.json             all conditions, 20 pilots each: three minutes
"""
_SEEDS, _QUICK_SEEDS = 20, 3


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    parser = subparsers.add_parser(
        "envelope",
        help="hold the firmware against what a real collective meets",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    parser.add_argument("--list", action="store_true", help="print the conditions and their limits, and stop")
    parser.add_argument("--quick", action="store_true", help=f"some conditions, {_QUICK_SEEDS} pilots each")
    parser.add_argument("--seeds", type=int, metavar="N", help=f"random pilots a condition (default: {_SEEDS})")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="conditions of --list (default: all)")
    parser.add_argument(
        "-o",
        "--out",
        metavar="DIR",
        type=Path,
        default=Path("lever_envelope"),
        help="folder for the page, envelope.html (default: %(default)s)",
    )
    parser.add_argument(
        "--json", metavar="FILE", help='also write the rows to FILE: {"rows": [{"name", "measured", …}], …}'
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """`lever envelope`."""
    from lever_cdkf.host_tools.tables import print_tables

    from ..envelope import table
    from ..envelope.conditions import CONDITIONS

    if args.list:
        print_tables({"conditions": [_listed(condition) for condition in CONDITIONS.values()]}, args.json)
        return 0
    require("report")
    chosen = _chosen(args)
    seeds = args.seeds if args.seeds is not None else _QUICK_SEEDS if args.quick else _SEEDS
    if not 1 <= seeds <= 1000:
        raise LeverError(f"--seeds {seeds}: must be from 1 to 1000")
    make_folder(args.out)  # before a campaign that could then not be kept
    results = _run(chosen, seeds)
    print_tables({f"{seeds} random pilots a condition": table.lines(results)})
    missed = [result.condition.name for result in results if not result.ok]
    judged = sum(bool(result.condition.limits) for result in results)
    say(f"{judged - len(missed)} of {judged} conditions hold." + (f" Missed: {', '.join(missed)}." if missed else ""))
    _write(args, results, seeds)
    return 1 if missed else 0


def _run(chosen: Sequence[Condition], seeds: int) -> list[Result]:
    from ..envelope import campaign
    from ..envelope.conditions import CONDITIONS

    with Progress("envelope") as progress:
        return campaign.run(chosen, CONDITIONS, seeds, progress.show)


def _write(args: argparse.Namespace, results: Sequence[Result], seeds: int) -> None:
    """The files that were asked for."""
    import json
    from dataclasses import asdict

    from lever_cdkf.host_tools.provenance import provenance, with_provenance

    from ..envelope import envelope_page, table

    origin = provenance()
    if args.json is not None:
        content = {"rows": table.rows(results), "provenance": asdict(origin)}
        write_text(args.json, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    write_text(args.out / "envelope.html", with_provenance(envelope_page.build(results, seeds), origin))
    say(f"Written to {args.out}: envelope.html")


def _listed(condition: Condition) -> dict[str, str | bool]:
    limits = ", ".join(f"{limit.figure} {limit}" for limit in condition.limits)
    instead = ", ".join(f"{limit.figure} {limit}" for limit in condition.unless)
    text = f"{limits}; or {instead}" if instead else limits or "reported only"
    return {"name": condition.name, "quick": condition.quick, "title": condition.title, "must": text}


def _chosen(args: argparse.Namespace) -> list[Condition]:
    """The conditions that were asked for. Raises LeverError for one that is not known."""
    from ..envelope.conditions import CONDITIONS

    check_names("condition", args.only or (), CONDITIONS, "lever envelope --list")
    if args.only:
        return [CONDITIONS[name] for name in dict.fromkeys(args.only)]
    return [condition for condition in CONDITIONS.values() if condition.quick or not args.quick]
