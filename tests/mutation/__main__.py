"""Says which mutants of the core the unit tests kill.

    python tests/mutation BUILD [--random N] [--seed S] [--file PART] [--json FILE]

BUILD is build/tests/mutation, made by the target `mutated`. Survivors are listed as they are found.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import time
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from mutation.killing import judged, measured
from mutation.schemata import Mutant


def main() -> int:
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__.splitlines()[0])
    parser.add_argument("build", type=lambda path: Path(path).resolve())
    parser.add_argument("--random", type=int, metavar="N", help="only so many")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the choice (default: %(default)s)")
    parser.add_argument("--file", default="", help="only of these files: a part of their path")
    parser.add_argument("--least", type=float, default=0.0, metavar="PERCENT", help="exit 1 when fewer are killed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every verdict")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    found = json.loads((args.build / "firmware/mutants.json").read_text())
    mutants = [Mutant(**each) for each in found["mutants"] if args.file in each["path"]]
    if args.random:
        mutants = sorted(random.Random(args.seed).sample(mutants, args.random), key=lambda each: each.number)
        print(f"{args.random} mutants drawn with seed {args.seed}")
    start = time.monotonic()
    programs = [measured(args.build / "programs" / name) for name in (args.build / "programs.txt").read_text().split()]
    programs += [measured(args.build / "oracle", case) for case in sorted((args.build / "cases").glob("*.case"))]
    verdicts = []
    for verdict in judged(mutants, programs, args.jobs):
        verdicts.append(verdict)
        if not verdict.killer:
            print(f"{verdict.mutant}{'' if verdict.reached else '  (not reached)'}", flush=True)
    killed = sum(bool(verdict.killer) for verdict in verdicts)
    share = 100 * killed / len(mutants)
    print(f"{killed} of {len(mutants)} mutants killed ({share:.1f} %) in {time.monotonic() - start:.0f} s")
    print(f"{found['left_out']} more in constant expressions, which cannot be switched, were left out")
    if args.json:
        args.json.write_text(json.dumps([asdict(verdict) for verdict in verdicts]))
    return 1 if share < args.least else 0


if __name__ == "__main__":
    sys.exit(main())
