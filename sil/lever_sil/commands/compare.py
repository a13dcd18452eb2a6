"""`lever compare`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.cli.layout import say, warn
from lever_cdkf.cli.progress import Progress
from lever_cdkf.cli.tables import Row, add_json_option
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.extras import require
from lever_cdkf.runtime.files import made_folder
from lever_cdkf.text.counts import counted

from .names import check_names, seed

if TYPE_CHECKING:
    from ..study.compare.cases import Plan
    from ..study.compare.run_cases import Task

_DESCRIPTION = """\
Runs the firmware's estimators and published ones on the same data and ranks them in each case: errors, errors against
those of a Kalman filter linearised at the truth and against the posterior Cramér-Rao bound, consistency of the stated
uncertainty (normalised estimation error squared, NEES; normalised innovation squared, NIS), time to follow a step of
the pilot, processor time per sample (step). Cases are matched random walks, sudden changes of the
pilot's grip, wrong settings of the noise, and the scenarios of `lever sim`. A difference is called significant by
paired bootstrap over runs, at 5 % for all comparisons together (Holm); below 8 runs there is no verdict. With --out
also writes into DIR

  compare.csv      every figure of every estimator in every case
  compare.html     verdicts, figures and tables as one page for a browser
  FIGURE.pdf .svg  each figure of the page for print, two columns of a journal wide; FIGURE.csv: its numbers
  provenance.json  version, revision, date and command that made them

With --paper instead: the experiment of the paper that the estimator comes from (sil/lever_sil/study/PAPER.md), by 20
seeds: parameters that stay, drift or jump, two levels of noise in each channel, each kind of parameter noise. A table
for each model; cells are median / worst of all runs and levels of noise. Some minutes of processor time.

With --data alone: writes the runs into DIR as Parquet, with their truth, and an index with checksums, for estimators
that are not in Python. With --score: an estimator of yours takes part, a class with the methods start(config),
step(sample) and estimate() (sil/lever_sil/study/PAPER.md has an example), beside two others unless --estimators names
some, on 20 runs each of lever_trim_dither_rough and step_up unless --scenarios and --seeds say otherwise; with both
options, on the runs in DIR.

With --envelope instead: the firmware beside joint EKF and UKF in the conditions of `lever envelope` (8 pilots each),
these given the true process noise and the trim, with and without a fourth-order high-pass (_hp) in front.
Prints rms error of the natural frequency and how often the truth is within the stated ±2σ, median and worst pilot;
--json writes them as numbers.
"""
_EPILOG = """\
examples:
  lever compare --list
  lever compare --quick --out out/quick
  lever compare --scenarios step_up step_down --seeds 20
  lever compare --models lever --estimators dual joint joint_ekf --seeds 20 --out out/lever
  lever compare --out out/compare                the whole campaign, some ten minutes of processor time
  lever compare --paper --seeds 4                some runs of the experiment of the paper
  lever compare --score mine:Ukf --scenarios step_up --seeds 8        an estimator of yours beside two of these
  lever compare --data out/runs                                       the runs of two cases as files, for others
  lever compare --envelope --quick               some conditions of `lever envelope`, a minute on two cores
  lever compare --envelope --scenarios steady retrim --estimators firmware joint_ekf_hp

Times per sample are processor times, batched over runs for the baselines: compare them as ratios, and with care.
"""
_QUICK_CASES = ("lever_fixed_dither_rough", "linear_black_box_trim_base_rough", "step_up", "steady")
_QUICK_SEEDS, _QUICK_DURATION, _SEEDS = 8, 12.0, 40
_SEED = 1
_SCORED = 20
"""Seeds of the files, and with --score."""
_BESIDE = ("dual_shipped", "joint_ekf")
"""Beside a --score."""
_LIST = "lever compare --list"
_PROVENANCE = "provenance.json"


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever compare`."""
    compare = subparsers.add_parser(
        "compare", help="compare all estimators on the same data", description=_DESCRIPTION, epilog=_EPILOG
    )
    compare.add_argument("--list", action="store_true", help="print cases and estimators, and stop")
    compare.add_argument(
        "--envelope", action="store_true", help="joint EKF and UKF in the conditions of lever envelope"
    )
    compare.add_argument("--paper", action="store_true", help="the experiment of the paper, as a table for each model")
    compare.add_argument("--score", metavar="MODULE:CLASS", help="an estimator of yours, as one more")
    compare.add_argument("--data", metavar="DIR", type=Path, help="write the runs there; with --score read them")
    compare.add_argument(
        "--scenarios",
        nargs="+",
        metavar="NAME",
        help="cases of --list (default: all but those of --paper, wrong_tuning_*, remnant_*, square_wave)",
    )
    compare.add_argument("--models", nargs="+", metavar="MODEL", help="only cases of these models (default: all)")
    compare.add_argument("--estimators", nargs="+", metavar="NAME", help="estimators of --list (default: all)")
    compare.add_argument("--seeds", type=int, metavar="N", help=f"runs of each case (default: {_SEEDS})")
    compare.add_argument("--seed", type=seed, metavar="N", help=f"seed of the first (default: {_SEED})")
    compare.add_argument("--duration", type=float, metavar="SECONDS", help="of each run (default: each case's own)")
    compare.add_argument(
        "--quick", action="store_true", help=f"a few cases, {_QUICK_SEEDS} runs of {_QUICK_DURATION:g} s: a preview"
    )
    compare.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one a core)")
    compare.add_argument("-o", "--out", metavar="DIR", type=Path, help="folder for the files (default: no files)")
    add_json_option(compare)
    compare.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """`lever compare`."""
    from lever_cdkf.cli.tables import print_tables

    if args.list and not args.envelope:
        print_tables(_listed(), args.json)
        return 0
    require("study")
    if args.envelope:
        from . import compare_envelope

        _check(args.seeds, args.duration, args.jobs)
        return compare_envelope.run(args)
    if args.paper:
        return _paper(args)
    if args.data is not None and args.score is None:
        return _data(args)
    return _compare(args)


def _compare(args: argparse.Namespace) -> int:
    """Run all estimators that take part on all cases that were asked for."""
    from ..study.compare import entrants, run_cases

    if args.score is not None:
        entrants.enter(args.score)
    plan, names = _drawn(args) if args.data is None else _of_files(args)
    todo = run_cases.tasks(names, _estimators(args), plan)
    if not todo:
        raise LeverError("none of these estimators takes part in any of these cases; see `lever compare --list`")
    if idle := [name for name in args.estimators or () if name not in {task.entrant for task in todo}]:
        warn(f"not run, as none of these cases has it: {', '.join(idle)}; see `lever compare --list`")
    with made_folder(args.out):  # before a campaign that could then not be kept
        _run(todo, args)
    return 0


def _run(todo: list[Task], args: argparse.Namespace) -> None:
    """Run the tasks; print the figures, and write the files that were asked for."""
    from lever_cdkf.cli.tables import print_tables

    from ..study.compare import evaluation, run_cases, table, verdicts

    with Progress("compare") as progress:
        results = run_cases.run(todo, args.jobs, progress.show)
    rows = evaluation.judge(results)
    claims = verdicts.claims(rows) if results.plan.is_whole else []
    by_case = verdicts.verdicts(rows, *evaluation.compare(results, rows))
    tables = table.tables(rows, claims)
    print_tables(tables, args.json)
    for case, verdict in by_case.items():
        say(f"{case}: {verdict}")
    if args.out is not None:
        from lever_cdkf.runtime.files import Outputs, write_text, writing
        from lever_cdkf.runtime.provenance import provenance, with_provenance

        from ..study.compare import compare_page, printed

        with Outputs(args.out) as outputs:
            origin = provenance()
            page, figures = compare_page.build(results, rows, by_case, claims, tables)
            files = {
                "compare.html": with_provenance(page, origin).encode(),
                "compare.csv": table.csv_text(rows).encode(),
            }
            drawn = dict(printed.files(figures, origin))
            for name, content in (files | drawn).items():
                path = outputs.path(name)
                with writing(path):
                    path.write_bytes(content)
            write_text(outputs.path(_PROVENANCE), origin.with_outputs(outputs.written(*files, *drawn)).text())
            outputs.finish()
        kinds = ", ".join(dict.fromkeys(Path(name).suffix for name in drawn))
        as_drawn = [f"{counted(len(figures), 'figure')} as {kinds}"] if figures else []
        say(f"Written to {args.out}: {', '.join([*files, *as_drawn, _PROVENANCE])}")


def _drawn(args: argparse.Namespace) -> tuple[Plan, list[str]]:
    """Return the plan and the cases that the command line asks for."""
    from ..study.compare.cases import Plan

    usual = _SEEDS if args.score is None and args.data is None else _SCORED
    seeds = args.seeds if args.seeds is not None else (_QUICK_SEEDS if args.quick else usual)
    duration = args.duration if args.duration is not None else (_QUICK_DURATION if args.quick else None)
    _check(seeds, duration, args.jobs)
    return Plan(seeds, duration, _SEED if args.seed is None else args.seed), _cases(args)


def _paper(args: argparse.Namespace) -> int:
    """Run `lever compare --paper`."""
    from lever_cdkf.cli.tables import print_tables

    from ..study.compare import paper, run_cases
    from ..study.compare.cases import Plan

    for option in ("scenarios", "models", "out", "quick", "score", "data"):
        if getattr(args, option):
            raise LeverError(f"--{option} does not go with --paper, which prints one fixed experiment; leave it out")
    seeds = paper.SEEDS if args.seeds is None else args.seeds
    _check(seeds, args.duration, args.jobs)
    plan = Plan(seeds, args.duration, _SEED if args.seed is None else args.seed)
    todo = run_cases.tasks(paper.names(), args.estimators and _estimators(args), plan)
    with Progress("compare") as progress:
        results = run_cases.run(todo, args.jobs, progress.show)
    print_tables(paper.tables(results), args.json)
    return 0


def _data(args: argparse.Namespace) -> int:
    """Run `lever compare --data`."""
    from ..study.compare import dataset

    for option in ("estimators", "out", "quick"):
        if getattr(args, option):
            raise LeverError(f"--{option} does not go with --data alone, which only writes runs; add --score")
    plan, names = _drawn(args)
    with Progress("data") as progress:
        for done, name in enumerate(dataset.write(args.data, names, plan), 1):
            progress.show(done, len(names), name)
    say(f"Written to {args.data}: {dataset.INDEX}, {', '.join(f'{name}.parquet' for name in names)}")
    return 0


def _of_files(args: argparse.Namespace) -> tuple[Plan, list[str]]:
    """Return plan and cases of the files that --data names."""
    from ..study.compare import dataset
    from ..study.compare.cases import cases

    for option in ("seeds", "seed", "duration", "quick", "models"):
        if getattr(args, option):
            raise LeverError(f"--{option} does not go with --data, which has its own runs; leave it out")
    plan, there = dataset.plan_of(args.data)
    check_names("scenario", there, cases(), _LIST)
    names: list[str] = args.scenarios or there
    check_names("scenario", names, there, f"{args.data / dataset.INDEX}")
    return plan, names


def _listed() -> dict[str, list[Row]]:
    from ..study.compare.cases import cases
    from ..study.compare.entrants import entrants

    by_name = {entrant.name: entrant for case in cases().values() for entrant in entrants(case).values()}
    return {
        "cases": [{"name": case.name, "duration [s]": case.duration, "title": case.title} for case in cases().values()],
        "estimators": [{"name": entrant.name, "title": entrant.title} for entrant in by_name.values()],
    }


def _cases(args: argparse.Namespace) -> list[str]:
    from ..study.compare import dataset
    from ..study.compare.cases import ON_REQUEST, cases

    usual = [name for name, case in cases().items() if case.kind not in ON_REQUEST]
    if args.score is not None or args.data is not None:
        usual = list(dataset.BENCHMARK)
    chosen = args.scenarios or (_QUICK_CASES if args.quick else usual)
    check_names("scenario", chosen, cases(), _LIST)
    models = {case.model for case in cases().values()}
    check_names("model", args.models or (), models, _LIST)
    return [name for name in chosen if not args.models or cases()[name].model in args.models]


def _estimators(args: argparse.Namespace) -> list[str]:
    from ..study.compare.cases import cases
    from ..study.compare.entrants import entrants

    names = list(dict.fromkeys(name for case in cases().values() for name in entrants(case)))
    check_names("estimator", args.estimators or (), names, _LIST)
    if args.score is not None:
        return [*(args.estimators or _BESIDE), args.score]
    return list(args.estimators or names)


def _check(seeds: int | None, duration: float | None, jobs: int) -> None:
    if seeds is not None and seeds < 1:
        raise LeverError(f"--seeds {seeds}: must be at least 1")
    if jobs < 1:
        raise LeverError(f"--jobs {jobs}: must be at least 1")
    if duration is not None and not 1.0 <= duration <= 3600.0:
        raise LeverError(f"--duration {duration:g}: must be from 1 to 3600 s")
