"""Says which mutants of the core the tests kill.

    python tests/mutation BUILD [--random N] [--seed S] [--file PART] [--assertions] [--json FILE]

BUILD is build/tests/mutation, made by the target `mutated`. Survivors are listed as they are found.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from mutation.equivalent import equivalents
from mutation.killing import Judge, Test
from mutation.schemata import Mutant

GOLDEN = Path(__file__).resolve().parents[1] / "quality/embedded/golden.txt"


def unit_tests(build: Path) -> Iterator[Test]:
    """Yield each test of the C programs."""
    for name in (build / "programs.txt").read_text().split():
        program = build / "programs" / name
        listed = subprocess.run([program, "--list"], stdout=subprocess.PIPE, text=True, check=True).stdout
        yield from (Test(program, (test,), f"{name}: {test}") for test in listed.splitlines())


def oracle_cases(build: Path) -> Iterator[Test]:
    for case in sorted((build / "cases").glob("*.case")):
        yield Test(build / "programs/oracle", (str(case),), f"oracle: {case.stem}")


def flights(build: Path, program: Path) -> Iterator[Test]:
    """Yield those whose bits are kept, each compared with all lines that it prints, so that it ends at the first
    difference. Raise RuntimeError when they are not the accepted ones."""
    lines: dict[str, list[str]] = defaultdict(list)
    flown = subprocess.run([program], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines(keepends=True)
    if [line for line in flown if len(line.split()) == 2] != GOLDEN.read_text().splitlines(keepends=True):
        raise RuntimeError("the flights are not the accepted ones: cmake --build build --target golden-accept")
    for line in flown:
        run = line.split()[0]
        lines["codec" if run.startswith("codec.") else run].append(line)
    for run, expected in lines.items():
        file = build / "cases" / f"{run}.lines"
        file.write_text("".join(expected))
        yield Test(build / "programs/flights", (str(file), run), f"flight: {run}")


def main() -> int:
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__.splitlines()[0])
    parser.add_argument("build", type=lambda path: Path(path).resolve())
    parser.add_argument("--random", type=int, metavar="N", help="only so many")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the choice (default: %(default)s)")
    parser.add_argument("--file", default="", help="only of these files: a part of their path")
    parser.add_argument("--assertions", action="store_true", help="without the flights whose bits are kept")
    parser.add_argument("--least", type=float, default=0.0, metavar="PERCENT", help="exit 1 when fewer are killed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every verdict")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    found = json.loads((args.build / "firmware/mutants.json").read_text())
    known = [Mutant(**each) for each in found["mutants"]]
    same = equivalents(known)
    mutants = [each for each in known if args.file in each.path and each.number not in same]
    if args.random:
        mutants = sorted(random.Random(args.seed).sample(mutants, args.random), key=lambda each: each.number)
        print(f"{args.random} mutants drawn with seed {args.seed}")
    start = time.monotonic()
    tests = [*unit_tests(args.build), *oracle_cases(args.build)]
    if not args.assertions:
        tests += flights(args.build, args.build.parent / "lever_flights")
    verdicts = []
    with Judge(args.jobs) as judge:
        for verdict in judge.verdicts(mutants, judge.measured(tests)):
            verdicts.append(verdict)
            if not verdict.killer:
                print(f"{verdict.mutant}{'' if verdict.reached else '  (not reached)'}", flush=True)
    killed = sum(bool(verdict.killer) for verdict in verdicts)
    share = 100 * killed / len(mutants)
    print(f"{killed} of {len(mutants)} mutants killed ({share:.1f} %) in {time.monotonic() - start:.0f} s")
    print(f"left out: {len(same)} that change nothing; {found['left_out']} in constant expressions, not to be switched")
    if args.json:
        summary = {"valid": len(mutants), "killed": killed, "equivalent": len(same)}
        args.json.write_text(json.dumps({**summary, "verdicts": [asdict(verdict) for verdict in verdicts]}))
    return 1 if share < args.least else 0


if __name__ == "__main__":
    sys.exit(main())
