"""Runs a command where there is a CAN interface vcan0 that nobody else uses: see place.py.

python tests/vcan [--time-limit SECONDS] [--uml] -- COMMAND [ARGUMENT]...

Exit status: the command's; 124 when the time limit struck; 125 when User-Mode Linux is needed and lacking, or does not
boot.
"""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parent.parent)

from vcan import place, uml  # noqa: E402

TIME_LIMIT_STRUCK = 124
NO_MACHINE = 125


def main() -> int:
    """Return the command line."""
    parser = argparse.ArgumentParser(prog="python tests/vcan", description="Runs a command where a vcan0 is up.")
    parser.add_argument("--time-limit", type=float, default=600.0, metavar="SECONDS", help="default: %(default)g")
    parser.add_argument("--uml", action="store_true", help="in User-Mode Linux, even where this kernel has vcan")
    parser.add_argument("command", nargs="+", metavar="COMMAND", help="after --")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        return place.run(options.command, time_limit_s=options.time_limit, force_uml=options.uml)
    except TimeoutError as error:
        print(f"vcan: {error}", file=sys.stderr)
        return TIME_LIMIT_STRUCK
    except uml.UmlError as error:
        print(f"vcan: {error}", file=sys.stderr)
        return NO_MACHINE


if __name__ == "__main__":
    sys.exit(main())
