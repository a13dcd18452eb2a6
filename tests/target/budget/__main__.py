"""What the estimator costs on a Cortex-M4F: see README.md."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path[0] = str(Path(__file__).resolve().parents[2])

from lever_cdkf.host_tools.errors import LeverError  # noqa: E402
from lever_cdkf.host_tools.files import write_text  # noqa: E402
from lever_cdkf.host_tools.progress import Progress  # noqa: E402
from lever_cdkf.host_tools.tables import Row, print_tables  # noqa: E402
from target.budget import image, measure  # noqa: E402
from target.budget.recording import MODELS, record  # noqa: E402

_DESCRIPTION = "What the estimator costs on a Cortex-M4F, counted in QEMU over the recorded samples of a simulated run."
_EPILOG = """\
examples:
  python tests/target/budget table
  python tests/target/budget table --firmware ../other/firmware --build /tmp/other
  python tests/target/budget profile --estimator joint --learning with
  python tests/target/budget profile --form tick --window 6:7 --worst
"""
ROOT = Path(__file__).resolve().parents[3]


def _table(args: argparse.Namespace) -> int:
    elf = image.build(args.build, args.firmware, args.flags)
    with Progress("budget") as progress:
        runs = measure.run_all(elf, progress.show)
    budget = measure.budget(elf, runs)
    _print(budget)
    if args.json is not None:
        write_text(args.json, json.dumps(budget, indent=2) + "\n")
    return 0


def _print(budget: dict[str, Any]) -> None:
    rows: list[Row] = []
    for what in ("dual", "joint", "tick"):
        entries = budget["instructions"][what]
        nested = entries.items() if what == "tick" else [(what, entries)]
        for estimator, models in nested:
            for model, entry in models.items():
                rows.append(
                    {
                        "measured": "whole tick" if what == "tick" else "lever_update()",
                        "estimator": estimator,
                        "model": model,
                        "mean": entry["mean"],
                        "median": entry["median"],
                        "worst": entry["worst"],
                        "at [s]": entry["worst_s"],
                        "worst / mean": round(entry["worst"] / entry["mean"], 3),
                        "worst at start": entry["start_up_worst"],
                    }
                )
    bytes_rows: list[Row] = [
        {"what": name.removesuffix("_bytes"), "bytes": value} for name, value in budget.items() if name.endswith("_bytes")
    ]
    print_tables({f"Instructions on a {budget['processor']}, {budget['compiler']}": rows, "Memory": bytes_rows})


def _profile(args: argparse.Namespace) -> int:
    from target.budget import hot_spots, trace

    elf = image.build(args.build, args.firmware, args.flags)
    recording = record(args.model)
    first, last = (round(1000.0 * float(time)) for time in args.window.split(":"))
    traced = trace.trace(elf, recording, args.model, args.estimator, args.form, first, last - 1)
    chosen = list(range(len(traced.instructions)))
    if args.worst:
        chosen = [int(traced.instructions.argmax())]
    if args.learning is not None:
        threshold = 1.1 * float(np.median(traced.instructions))
        chosen = [i for i in chosen if (traced.instructions[i] > threshold) == (args.learning == "with")]
    executed = [traced.executed[i] for i in chosen]
    instructions, operations = traced.instructions[chosen], traced.operations[chosen]
    print(
        f"{args.estimator} {args.model} {args.form}: {len(chosen)} samples from {first + chosen[0]} on, mean "
        f"{instructions.mean():.1f} instructions and {operations.mean():.1f} floating-point operations, "
        f"{instructions.min()} to {instructions.max()} instructions"
    )
    print_tables(hot_spots.tables(elf, executed, args.lines), args.json)
    return 0


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python tests/target/budget", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--firmware", type=Path, default=image.FIRMWARE, metavar="DIR", help="default: this tree's")
    common.add_argument("--build", type=Path, metavar="DIR", help="where the image is built (default: build/target/image)")
    common.add_argument("--flags", default="-O3 -DNDEBUG", help="of the optimiser (default: %(default)s, as shipped)")
    common.add_argument("--json", metavar="FILE", help="also write what is printed to FILE")
    what = parser.add_subparsers(required=True, metavar="WHAT")
    table = what.add_parser("table", parents=[common], help="the whole budget: instructions, bytes, stack")
    table.set_defaults(run=_table)
    profile = what.add_parser("profile", parents=[common], help="where the instructions of a step go")
    profile.add_argument("--model", choices=MODELS, default=MODELS[0], help="default: %(default)s")
    profile.add_argument("--estimator", choices=image.ESTIMATORS, default="dual", help="default: %(default)s")
    profile.add_argument("--form", choices=image.FORMS, default="update", help="lever_update() alone, or the whole tick")
    profile.add_argument("--window", metavar="FROM:TO", default="2:3", help="time [s] (default: %(default)s)")
    profile.add_argument("--worst", action="store_true", help="only the worst step of the window")
    profile.add_argument("--learning", choices=("with", "without"), help="only steps more than 10 %% above the median, or only the others")
    profile.add_argument("--lines", type=int, default=40, metavar="N", help="source lines to show (default: %(default)s)")
    profile.set_defaults(run=_profile)
    args = parser.parse_args()
    args.build = args.build or ROOT / "build/target/image"
    try:
        return int(args.run(args))
    except LeverError as error:
        print(f"budget: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
