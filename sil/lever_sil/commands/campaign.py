"""`lever campaign`."""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.cli.layout import command_lines, say, terminal_width
from lever_cdkf.cli.tables import add_json_option
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import check_not_input
from lever_cdkf.text.counts import counted

if TYPE_CHECKING:
    from ..campaign.chunks import Plan
    from ..campaign.session import Session
    from ..campaign.spec import Spec

_DESCRIPTION = """\
Runs a scenario at every point of a design (a grid, a Latin hypercube or random points over any of its values), with
several seeds and several estimators on the same simulated flights, on as many processes or machines as Dask has. A run
is an estimator in a flight. Writes into DIR

  *.parquet      a row for each run: errors, coverage, consistency, settling, or why it failed
  spec.json      the spec and its scenario, so that DIR can be read without them
  summary.json   runs, failed, real_time_factor_per_core, …
  map.html       maps over the design, with the border where tracking fails; map.svg and border.csv are of it, too

Whatever is killed meanwhile, --resume goes on with what is not there yet: no run is lost, and none is done twice. The
rows are the same to the byte however many workers there are.

Exit status: 0 when all runs are done, failed ones included; 1 when some killed the workers that tried them.
"""
_EPILOG = """\
examples:
  lever campaign --list
  lever campaign quick -o out/quick
  lever campaign my_own.toml -o out/mine --workers 8
  lever campaign my_own.toml -o out/mine --resume          after it was interrupted
  lever campaign tracking -o /shared/tracking --scheduler tcp://10.0.0.1:8786
  lever campaign quick --run 17                            that run alone, and the command that shows it

Workers at a scheduler need the same lever-cdkf installed, and DIR on a file system that they share.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever campaign`."""
    campaign = subparsers.add_parser(
        "campaign",
        help="run a scenario over a design of its values, on many cores",
        description=_DESCRIPTION,
        epilog=_EPILOG,
    )
    what = campaign.add_mutually_exclusive_group(required=True)
    what.add_argument("spec", nargs="?", metavar="SPEC", help="a name of --list, or the path of a .toml file")
    what.add_argument("--list", action="store_true", help="print the specs that come with the package")
    campaign.add_argument("-o", "--out", metavar="DIR", type=Path, help="folder for the files")
    campaign.add_argument("--workers", metavar="N", type=int, help="processes on this machine (default: one a core)")
    campaign.add_argument("--scheduler", metavar="ADDRESS", help="use the Dask cluster of this scheduler instead")
    campaign.add_argument("--resume", action="store_true", help="go on with the campaign that DIR holds in part")
    campaign.add_argument("--run", dest="number", metavar="NUMBER", type=int, help="do this run alone and print it")
    add_json_option(campaign)
    campaign.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """`lever campaign`."""
    if not args.list:
        require("campaign")

    from lever_cdkf.cli.tables import print_tables

    from ..campaign import spec
    from ..campaign.chunks import Plan

    if args.list:
        listed = [spec.load(name) for name in spec.names()]
        print_tables(
            {"specs": [{"name": each.name, "runs": each.runs, "title": each.title} for each in listed]}, args.json
        )
        return 0
    chosen = spec.load(args.spec)
    check_not_input(args.json, [chosen.file])
    if args.number is not None:
        return _one(chosen, args)
    if args.out is None:
        raise LeverError("-o DIR is missing: the folder for the files")
    if args.workers is not None and (args.workers < 1 or args.scheduler is not None):
        raise LeverError("--workers: must be at least 1, and does not go with --scheduler")
    plan, folder = Plan(chosen), args.out.resolve()
    for doubt in chosen.doubts:
        print(f"lever: campaign: some runs will fail: {doubt}", file=sys.stderr)
    try:
        session = _run(plan, folder, args)
    except KeyboardInterrupt:
        kept = sum(plan.runs(plan.chunk(number)) for number in plan.done(folder))
        raise KeyboardInterrupt(f"{kept} of {plan.spec.runs} runs kept; go on with --resume") from None
    return _finish(plan, folder, session, args)


def _run(plan: Plan, folder: Path, args: argparse.Namespace) -> Session:
    from lever_cdkf.cli.progress import Progress
    from lever_cdkf.runtime.files import made_folder

    from ..campaign import spec
    from ..campaign.session import Session, connected, dashboard, run

    with made_folder(folder):
        done = len(plan.done(folder))
        if done and not args.resume:
            raise LeverError(f"{args.out} holds {done} of the {plan.count} chunks of this campaign: add --resume")
        spec.save(plan.spec, folder)
    if done == plan.count:
        return Session()
    with connected(args.scheduler, args.workers or os.cpu_count() or 1) as client, Progress("campaign") as progress:
        work = f"{counted(plan.spec.runs, 'run')} in {counted(plan.count, 'chunk')}"
        print(f"{work}; dashboard: {dashboard(client)}", flush=True)
        return run(plan, folder, client, progress.show)


def _finish(plan: Plan, folder: Path, session: Session, args: argparse.Namespace) -> int:
    """Return files of what is done, and what is printed of it."""
    from lever_cdkf.cli.tables import print_tables
    from lever_cdkf.runtime.files import write_text
    from lever_cdkf.runtime.provenance import provenance

    from ..campaign import maps, summary
    from ..campaign.chunks import SUMMARY

    if len(session.lost) == plan.count:
        raise LeverError(
            "every chunk killed the workers that tried it: give the workers more memory, or go on with --resume"
        )
    for unfinished in folder.glob(f".{plan.fingerprint}-*.tmp"):  # of workers that were killed
        unfinished.unlink(missing_ok=True)
    origin = provenance([plan.spec.file] if args.spec == plan.spec.file else [])
    found = summary.build(plan, folder, session) | {"provenance": asdict(origin)}
    print_tables({plan.spec.title: summary.by_estimator(plan, folder)}, args.json)
    write_text(folder / SUMMARY, json.dumps(found, indent=2, allow_nan=False) + "\n")
    errors = summary.errors(folder)
    for row in errors:
        alone = shlex.join(["lever", "campaign", args.spec, "--run", str(row["run"])])
        say(f"failed: {row['estimator']}, seed {row['seed']}: {row['error']}; alone: {alone}")
    if found["failed"] > len(errors):
        say(f"failed: {found['failed'] - len(errors)} more: the rows with an error")
    factor = found["real_time_factor_per_core"]
    speed = f", {factor:g} × real time a core." if factor else "."
    say(f"{counted(found['runs'], 'run')}, {found['failed']} failed{speed}")
    chunks = counted(len(list(folder.glob("*.parquet"))), "Parquet file")
    written = [*maps.write(plan, folder, origin), SUMMARY, chunks]
    say(f"Written to {args.out}: {', '.join(written)}")
    if session.lost:
        flights = ", ".join(f"{chunk.first} to {chunk.end - 1}" for chunk in session.lost)
        missing = counted(plan.spec.runs - found["runs"], "run")
        print(f"lever: campaign: {missing} missing: flights {flights} killed their workers", file=sys.stderr)
        return 1
    return 0


def _one(chosen: Spec, args: argparse.Namespace) -> int:
    """Make and print one run alone."""
    from lever_cdkf.cli.tables import print_tables

    from ..campaign import design
    from ..campaign.entrants import FIRMWARE
    from ..campaign.runs import rows

    if not 0 <= args.number < chosen.runs:
        raise LeverError(f"--run {args.number}: the campaign has the runs 0 to {chosen.runs - 1}")
    flight, place = divmod(args.number, len(chosen.estimators))
    row = list(rows(chosen, range(flight, flight + 1)))[place]
    print_tables({f"run {args.number}": [{"column": name, "value": value} for name, value in row.items()]}, args.json)
    overrides = ["limits={}", *chosen.overrides(design.point(chosen, flight // chosen.seeds))]
    if row["estimator"] in FIRMWARE:
        overrides.append(f"estimator.estimator={row['estimator']}")
    settings = [part for override in overrides for part in ("--set", override)]
    say("The same flight with the firmware in it, and a report:")
    command = shlex.join(["lever", "sim", chosen.scenario_file, "--seed", str(row["seed"]), *settings, "--out", "DIR"])
    print(*command_lines(command, terminal_width()), sep="\n")
    return 1 if row.get("error") else 0
