"""Fuzzes for as long as one likes: python tests/fuzz [--seconds N] [--steps N] [--build DIR] [--json FILE] [TARGET...].

Inputs that reach something new are kept in DIR, so that a later run goes on from there. A finding is written there,
too, and ends the run with status 1.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from datetime import datetime, timezone
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fuzz import libfuzzer


def main() -> int:
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("target", nargs="*", metavar="TARGET", help=f"of {', '.join(libfuzzer.SOURCES)}; default: all")
    parser.add_argument("--seconds", type=int, default=600, metavar="N", help="for each target (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=0, metavar="N", help="go on until the estimator has made so many")
    parser.add_argument("--build", type=Path, default=Path("build/fuzz"), metavar="DIR", help="default: %(default)s")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was run")
    args = parser.parse_args()
    unknown = sorted(set(args.target) - set(libfuzzer.SOURCES))
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; there are {', '.join(libfuzzer.SOURCES)}")
    if args.steps and args.target != ["app"]:
        parser.error("only the target app counts steps")
    rows: dict[str, dict[str, int]] = {}
    findings = 0
    for name in args.target or libfuzzer.SOURCES:
        print(f"-- fuzzing {name} for {args.seconds} s", flush=True)
        try:
            program = libfuzzer.build(name, args.build)
        except libfuzzer.FuzzError as error:
            print(f"fuzz: {error}", file=sys.stderr)
            return 2
        rows[name] = _fuzz(program, args.build / f"{name}.corpus", args.seconds, args.steps)
        print(f"-- {name}: {', '.join(f'{key} {value}' for key, value in rows[name].items())}", flush=True)
        findings += rows[name]["findings"]
    if args.json:
        content = {
            "date": datetime.now(timezone.utc).strftime("%Y-%m-%d"),
            "findings": findings,
            "executions": sum(row["executions"] for row in rows.values()),
            "targets": rows,
        }
        args.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return 1 if findings else 0


def _fuzz(program: Path, corpus: Path, seconds: int, steps: int) -> dict[str, int]:
    """Until the time is over and the steps are made, or something is found, which is printed."""
    first = seed = int(time.time()) & 0x7FFFFFFF
    began = time.monotonic()
    row = {"first_seed": first, "runs": 0, "executions": 0, "steps": 0, "seconds": 0, "findings": 0}
    while not row["findings"] and (row["runs"] == 0 or row["steps"] < steps):
        if steps:  # from the seeds again: what was kept would be run again in each run
            shutil.rmtree(corpus, ignore_errors=True)
        result = libfuzzer.run(program, corpus, [f"-seed={seed}", f"-max_total_time={seconds}"])
        seed += 1
        row["runs"] += 1
        row["executions"] += result.count("number_of_executed_units")
        row["steps"] += result.count("estimator_steps")
        row["seconds"] = round(time.monotonic() - began)
        row["findings"] += int(result.found)
        if result.found:
            print(result.text[-4000:], file=sys.stderr)
    return row


if __name__ == "__main__":
    sys.exit(main())
