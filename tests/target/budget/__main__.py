"""What the estimator costs on a Cortex-M4F: see README.md.

python tests/target/budget [table] [--firmware DIR] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

sys.path[0] = str(Path(__file__).resolve().parents[2])

from lever_cdkf.host_tools.errors import LeverError  # noqa: E402
from lever_cdkf.host_tools.files import write_text  # noqa: E402
from lever_cdkf.host_tools.progress import Progress  # noqa: E402
from lever_cdkf.host_tools.tables import Row, print_tables  # noqa: E402
from target.budget import image, measure  # noqa: E402

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


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python tests/target/budget", description="What the estimator costs on a Cortex-M4F."
    )
    parser.add_argument("--firmware", type=Path, default=image.FIRMWARE, metavar="DIR", help="default: this tree's")
    parser.add_argument("--build", type=Path, metavar="DIR", help="where the image is built (default: build/target/image)")
    parser.add_argument("--flags", default="-O3 -DNDEBUG", help="of the optimiser (default: %(default)s, as shipped)")
    parser.add_argument("--json", metavar="FILE", help="write it all to FILE")
    args = parser.parse_args()
    args.build = args.build or ROOT / "build/target/image"
    try:
        return _table(args)
    except LeverError as error:
        print(f"budget: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
