"""Fuzzes for as long as one likes: python tests/fuzz [--seconds N] [--build DIR] [TARGET...].

Inputs that reach something new are kept in DIR, so that a later run goes on from there. A finding is written there,
too, and ends the run with status 1.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fuzz import libfuzzer


def main() -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("target", nargs="*", metavar="TARGET", help=f"of {', '.join(libfuzzer.SOURCES)}; default: all")
    parser.add_argument("--seconds", type=int, default=600, metavar="N", help="for each target (default: %(default)s)")
    parser.add_argument("--build", type=Path, default=Path("build/fuzz"), metavar="DIR", help="default: %(default)s")
    args = parser.parse_args()
    unknown = sorted(set(args.target) - set(libfuzzer.SOURCES))
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; there are {', '.join(libfuzzer.SOURCES)}")
    for name in args.target or libfuzzer.SOURCES:
        print(f"-- fuzzing {name} for {args.seconds} s", flush=True)
        try:
            program = libfuzzer.build(name, args.build)
        except libfuzzer.FuzzError as error:
            print(f"fuzz: {error}", file=sys.stderr)
            return 2
        result = libfuzzer.run(program, args.build / f"{name}.corpus", [f"-max_total_time={args.seconds}"])
        if result.found:
            print(result.text[-4000:], file=sys.stderr)
            return 1
        for line in re.findall(r"stat::(number_of_executed_units|new_units_added): +(\d+)", result.text):
            print(f"-- {name}: {line[0].replace('_', ' ')} {line[1]}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
