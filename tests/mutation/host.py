"""Says which random mutants of `host_tools` and `sil` the Python tests kill.

    python tests/mutation/host.py [--count N] [--seed S] [--json FILE]

Mutants of python_equivalent.txt are not drawn. Each mutant meets the test files that call the function it is in, those
of its own folder first, until one fails. Which functions a test file calls is measured once and kept in
build/tests/mutation/reached.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from mutation.python_mutants import PythonMutant, drawn, text_with

ROOT = Path(__file__).resolve().parents[2]
HOOK = Path(__file__).resolve().parent / "hook"
EQUIVALENT = Path(__file__).with_name("python_equivalent.txt")
"""Mutants that change nothing that can be seen: the reason after #, their names below it."""
MUTATED = ("host_tools", "sil")
TESTS = ("tests/python", "tests/accuracy", "tests/slcan", "tests/target/slcan")
PATIENCE = 10
"""A mutant hangs when a test file takes so many times as long as without."""
GRACE = 60.0


@dataclass(frozen=True)
class TestFile:
    path: str
    seconds: float
    reached: frozenset[str]
    """path:line of the functions it calls."""

    def concerns(self, mutant: PythonMutant) -> bool:
        if mutant.function:
            return f"{mutant.path}:{mutant.function}" in self.reached
        return any(place.startswith(f"{mutant.path}:") for place in self.reached)


def files_under(folders: Sequence[str], name: str) -> list[Path]:
    return sorted(path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob(name))


def passes(test: str, environment: dict[str, str], timeout: float | None = None) -> bool:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", f"--basetemp={folder}/t", test]
        path = os.pathsep.join([str(HOOK), *filter(None, [os.environ.get("PYTHONPATH")])])
        whole = os.environ | environment | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        output = subprocess.DEVNULL
        with subprocess.Popen(
            command, cwd=ROOT, env=whole, stdout=output, stderr=output, stdin=output, start_new_session=True
        ) as process:
            try:
                return process.wait(timeout) == 0
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                return False


def measured(path: Path) -> TestFile | None:
    """Runs a test file without a mutant; None when it fails, which is said."""
    with tempfile.TemporaryDirectory() as folder:
        under = os.pathsep.join(str(ROOT / each) for each in MUTATED)
        start = time.monotonic()
        if not passes(str(path), {"REACHED": folder, "REACHED_UNDER": under}):
            print(f"{path} fails without a mutant, and is left out", flush=True)
            return None
        seconds = time.monotonic() - start
        lines = {line for file in Path(folder).iterdir() for line in file.read_text().splitlines()}
    return TestFile(str(path), seconds, frozenset(line.removeprefix(f"{ROOT}/") for line in lines))


def measured_once(kept: Path, jobs: int) -> list[TestFile]:
    """All test files, from the file where there is one."""
    if not kept.exists():
        with ThreadPoolExecutor(jobs) as pool:
            tests = pool.map(measured, files_under(TESTS, "test_*.py"))
            rows = [(test.path, test.seconds, sorted(test.reached)) for test in tests if test]
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(rows))
    return [TestFile(path, seconds, frozenset(reached)) for path, seconds, reached in json.loads(kept.read_text())]


def killer_of(mutant: PythonMutant, tests: Sequence[TestFile]) -> str:
    """The test file that fails with the mutant; none: it survives."""
    own = f"/{mutant.path.parent.name}/"
    able = sorted((test for test in tests if test.concerns(mutant)), key=lambda t: (own not in t.path, t.seconds))
    with tempfile.NamedTemporaryFile("w", suffix=".py", encoding="utf-8") as file:
        file.write(text_with(ROOT, mutant))
        file.flush()
        environment = {"MUTANT_OF": str(ROOT / mutant.path), "MUTANT_TEXT": file.name}
        for test in able:
            if not passes(test.path, environment, PATIENCE * test.seconds + GRACE):
                return test.path
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(prog="host", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, metavar="N")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the draw (default: %(default)s)")
    parser.add_argument("--list", action="store_true", help="say which are drawn, and run nothing")
    parser.add_argument("--only", default="", metavar="TEXT", help="those of the draw with this in their description")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every verdict")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    equivalent = EQUIVALENT.read_text(encoding="utf-8").splitlines()
    all_drawn = drawn(ROOT, files_under(MUTATED, "*.py"), args.count, args.seed, equivalent)
    mutants = [each for each in all_drawn if args.only in str(each)]
    if args.list:
        print(*mutants, sep="\n")
        return 0
    tests = measured_once(ROOT / "build/tests/mutation/reached.json", args.jobs)
    killers = []
    with ThreadPoolExecutor(args.jobs) as pool:
        for mutant, killer in zip(mutants, pool.map(lambda each: killer_of(each, tests), mutants), strict=True):
            print(f"{killer or 'SURVIVES'}  {mutant}", flush=True)
            killers.append(killer)
    print(f"{sum(map(bool, killers))} of {len(mutants)} mutants of seed {args.seed} killed")
    if args.json:
        args.json.write_text(json.dumps(dict(zip(map(str, mutants), killers, strict=True))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
