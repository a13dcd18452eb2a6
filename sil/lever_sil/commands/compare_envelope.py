"""`lever compare --envelope`."""

from __future__ import annotations

import argparse

from lever_cdkf.cli.layout import say
from lever_cdkf.cli.progress import Progress
from lever_cdkf.cli.tables import Row, print_tables, write_json
from lever_cdkf.errors import LeverError

from ..envelope import conditions
from ..study.compare_envelope import run_estimators, tables
from ..study.compare_envelope.filters import JOINT_FILTERS
from .names import check_names

SEEDS = 8
_NOT_HERE = ("models", "duration", "seed", "out", "score", "data")


def run(args: argparse.Namespace) -> int:
    """Return the firmware and joint EKF and UKF in the conditions of `lever envelope`."""
    if args.list:
        print_tables(_listed(), args.json)
        return 0
    for name in _NOT_HERE:
        if getattr(args, name) is not None:
            raise LeverError(f"--{name} does not go with --envelope")
    check_names("condition", args.scenarios or (), conditions.CONDITIONS, "lever compare --envelope --list")
    check_names("estimator", args.estimators or (), run_estimators.ESTIMATORS, "lever compare --envelope --list")
    usual = [name for name, one in conditions.CONDITIONS.items() if one.quick or not args.quick]
    wanted = [name for name in conditions.CONDITIONS if name in (args.scenarios or usual)]
    seeds = args.seeds if args.seeds is not None else SEEDS
    estimators = [name for name in run_estimators.ESTIMATORS if name in (args.estimators or run_estimators.ESTIMATORS)]
    with Progress("compare") as progress:
        results = run_estimators.run(wanted, seeds, estimators, args.jobs, progress.show)
    print_tables(tables.tables(results, seeds))
    for sentence in tables.verdicts(results):
        say(sentence)
    if args.json is not None:
        write_json(args.json, {"peers": tables.rows(results)})
    return 0


def _listed() -> dict[str, list[Row]]:
    titles = {run_estimators.FIRMWARE: "as shipped, with the settings of the condition"}
    titles |= {name: each.title for name, each in JOINT_FILTERS.items()}
    return {
        "conditions": [{"name": name, "title": one.title} for name, one in conditions.CONDITIONS.items()],
        "estimators": [{"name": name, "title": title} for name, title in titles.items()],
    }
