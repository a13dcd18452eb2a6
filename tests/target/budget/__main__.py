"""What the estimator costs on a Cortex-M4F: see README.md."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[2])

from lever_cdkf.errors import LeverError  # noqa: E402
from target.budget import hot_spots, image, images, quick, report  # noqa: E402
from target.budget.recording import MODELS  # noqa: E402

_BUILD = Path(__file__).resolve().parents[3] / "build/target"
_DESCRIPTION = """\
What the estimator costs on a Cortex-M4F: instructions of every step, counted in QEMU over the samples of a simulated
run; bytes of code and of an instance; the most stack that a call can take.
"""
_EPILOG = """\
examples:
  python tests/target/budget quick
  python tests/target/budget table
  python tests/target/budget table --check --firmware ../other/firmware --build /tmp/other
  python tests/target/budget profile --estimator joint --worst
  python tests/target/budget profile --form tick --window 6:7 --worst

Exit status: 0; 1 when --check finds a limit that does not hold or a regression; 2 when it cannot be measured.
"""


def _parser() -> argparse.ArgumentParser:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="python tests/target/budget", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=formatter
    )
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("--firmware", type=Path, default=image.FIRMWARE, metavar="DIR", help="default: this tree's")
    common.add_argument(
        "--build", type=Path, default=_BUILD / "image", metavar="DIR", help="where the image is built (%(default)s)"
    )
    common.add_argument(
        "--flags", default=image.SHIPPED, help="of the optimiser, e.g. --flags=-O2 (default, as shipped: %(default)s)"
    )
    common.add_argument("--json", metavar="FILE", help="also write what is measured to FILE")
    what = parser.add_subparsers(required=True, metavar="WHAT")
    table = what.add_parser("table", parents=[common], help="instructions, bytes, stack")
    table.add_argument("--check", action="store_true", help="against the limits and the golden values")
    table.add_argument(
        "--accept", action="store_true", help="make this the golden values, and what firmware/port/PORTING.md says"
    )
    table.add_argument(
        "--images",
        type=Path,
        default=_BUILD.parent / "stm32f4",
        metavar="DIR",
        help="of the port, to --accept (%(default)s)",
    )
    table.set_defaults(run=report.run)
    case = argparse.ArgumentParser(add_help=False)
    case.add_argument("--model", choices=MODELS, default=MODELS[0], help="default: %(default)s")
    case.add_argument("--estimator", choices=image.ESTIMATORS, default="dual", help="default: %(default)s")
    brief = what.add_parser("quick", parents=[common, case], help="one model and one estimator, in a few seconds")
    brief.set_defaults(run=quick.run)
    profile = what.add_parser("profile", parents=[common, case], help="where the instructions of a step go")
    profile.add_argument(
        "--form", choices=image.FORMS, default="update", help="lever_update() alone (the default), or the whole tick"
    )
    profile.add_argument("--window", metavar="FROM:TO", default="2:3", help="time [s] (default: %(default)s)")
    profile.add_argument("--worst", action="store_true", help="only the most expensive step of the window")
    profile.add_argument("--lines", type=int, default=40, metavar="N", help="source lines shown (default: %(default)s)")
    profile.set_defaults(run=hot_spots.run)
    tested = what.add_parser("images", parents=[common], help="only builds what the tests run, in and beside --build")
    tested.set_defaults(run=images.run)
    return parser


def main() -> int:
    """Return the command line."""
    args = _parser().parse_args()
    try:
        return int(args.run(args))
    except LeverError as error:
        print(f"budget: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
