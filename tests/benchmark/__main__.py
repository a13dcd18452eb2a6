"""Times the estimator on this machine: see README.md."""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parent.parent)

from benchmark import benchmark  # noqa: E402
from lever_cdkf.cli.progress import Progress  # noqa: E402
from lever_cdkf.cli.tables import Row, print_tables  # noqa: E402
from lever_cdkf.errors import LeverError  # noqa: E402
from lever_cdkf.runtime.files import write_text  # noqa: E402

_BUILD = Path(__file__).resolve().parents[2] / "build"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python tests/benchmark",
        description="How long lever_update() takes on this machine, and how many instructions (with valgrind).",
        epilog=f"Exit status 1 when a dual step with the lever model takes more than {benchmark.LIMIT_NS:g} ns.",
    )
    parser.add_argument(
        "--program", type=Path, default=_BUILD / "tests/lever_benchmark", metavar="FILE", help="default: %(default)s"
    )
    parser.add_argument("--json", metavar="FILE", help="also write what is measured to FILE")
    return parser


def _measure(args: argparse.Namespace) -> int:
    if not args.program.is_file():
        raise LeverError(f"{args.program} is not there: cmake --build build --target benchmark")
    valgrind = shutil.which("valgrind")
    results = []
    with Progress("benchmark") as progress:
        cases = benchmark.cases()
        for done, (estimator, model) in enumerate(cases):
            progress.show(done, len(cases), f"{estimator} {model}")
            results.append(benchmark.measure(args.program, estimator, model, valgrind))
    rows: list[Row] = [
        {
            "estimator": each.estimator,
            "model": each.model,
            "best [ns]": round(each.best_ns, 1),
            "median [ns]": round(each.median_ns, 1),
            "instructions": None if each.instructions is None else round(each.instructions, 1),
        }
        for each in results
    ]
    print_tables({"lever_update() on this machine, mean of a call": rows})
    if valgrind is None:
        print("no instructions are counted: apt install valgrind")
    if args.json is not None:
        write_text(args.json, json.dumps([dataclasses.asdict(each) for each in results], indent=2) + "\n")
    first = results[0]
    if first.best_ns > benchmark.LIMIT_NS:
        print(f"benchmark: {first.best_ns:.0f} ns: at most {benchmark.LIMIT_NS:g} are allowed", file=sys.stderr)
        return 1
    return 0


def main() -> int:
    """Return the command line."""
    args = _parser().parse_args()
    try:
        return _measure(args)
    except LeverError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
