"""Says which random mutants of `host_tools` and `sil` the Python tests kill.

    python tests/mutation/host.py [--count N] [--seed S] [--json FILE]

Mutants of python_equivalent.txt are not drawn. Each mutant meets the tests that call the function it is in, those of
its own folder first, until one fails. Which functions a test calls is measured once for each file of tests, and again
when that file is newer, and kept in build/tests/mutation/reached.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
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
IMPORTED = "<module>()"
PATIENCE = 10
"""A mutant hangs when a test takes so many times as long as without."""
GRACE = 240.0
NO_TESTS = 5
"""Exit status of pytest."""
IMPORTING = 300.0
"""[s] for what is not a test."""
AT_FIRST = 4
"""So many files are met by themselves: most mutants die there, without the imports of the others."""


@dataclass(frozen=True)
class Test:
    name: str
    seconds: float
    reached: frozenset[str]
    """path:name() of the functions it calls."""


@dataclass(frozen=True)
class TestFile:
    path: str
    reached: frozenset[str]
    """What is called by no single test: imports, fixtures that tests share."""
    tests: tuple[Test, ...]

    def able(self, mutant: PythonMutant) -> list[Test]:
        """Return the tests that may notice it: those that call its function first, then the shortest."""
        own = [test for test in self.tests if concerns(test.reached, mutant)]
        others = [test for test in self.tests if test not in own] if concerns(self.reached, mutant) else []
        return sorted(own, key=lambda test: test.seconds) + sorted(others, key=lambda test: test.seconds)


def concerns(reached: frozenset[str], mutant: PythonMutant) -> bool:
    """Return whether its function is reached; of a mutant outside of functions: any of its module."""
    if mutant.function:
        return f"{mutant.path}:{mutant.function}" in reached
    return any(place.startswith(f"{mutant.path}:") and not place.endswith(IMPORTED) for place in reached)


def files_under(folders: Sequence[str], name: str) -> list[Path]:
    return sorted(path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob(name))


def failure(arguments: Sequence[str], environment: dict[str, str], timeout: float | None = None) -> str:
    """Return what pytest says about the first test that fails; nothing: all pass."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        options = ["-q", "--tb=line", "-p", "no:cacheprovider", "-p", "selection", f"--basetemp={folder}/t"]
        rest = Path(folder, "arguments")  # files that are written say by which command: a long one would not be read
        rest.write_text("\n".join(arguments))
        path = os.pathsep.join([str(HOOK), *filter(None, [os.environ.get("PYTHONPATH")])])
        whole = os.environ | environment | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        with subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, f"@{rest}"], cwd=ROOT, env=whole,
            stdout=output, stderr=output, stdin=subprocess.DEVNULL, start_new_session=True,
        ) as process:  # fmt: skip
            try:
                status = process.wait(timeout)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                return "time-out"
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, 9)  # what its tests have left
        output.seek(0)
        lines = [line.strip() for line in output if line.startswith(("FAILED", "ERROR", "Timeout"))]
        return (lines or [f"status {status}"])[0] if status not in (0, NO_TESTS) else ""


def measured(path: Path, kept: Path) -> None:
    """Run a test file without a mutant, and keep what its tests call."""
    with tempfile.TemporaryDirectory() as folder:
        under = os.pathsep.join(str(ROOT / each) for each in MUTATED)
        fault = failure([str(path)], {"REACHED": folder, "REACHED_UNDER": under})
        if fault:
            print(f"{path} fails without a mutant: {fault}", flush=True)
        passed = json.loads(Path(folder, "passed.json").read_text())
        rows = [(name, seconds, calls_in(Path(notes))) for name, (notes, seconds) in passed.items()]
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps([str(path), calls_in(Path(folder)), rows]))


def calls_in(folder: Path) -> list[str]:
    files = (file for file in folder.iterdir() if file.name.isdecimal() and file.is_file())
    return sorted({line.removeprefix(f"{ROOT}/") for file in files for line in file.read_text().splitlines()})


def all_measured(folder: Path, jobs: int) -> list[TestFile]:
    paths = files_under(TESTS, "test_*.py")
    kept = [folder / f"{str(path).replace('/', '.')}.json" for path in paths]
    with ThreadPoolExecutor(jobs) as pool:
        for path, file in zip(paths, kept, strict=True):
            if not file.exists() or file.stat().st_mtime < (ROOT / path).stat().st_mtime:
                pool.submit(measured, path, file)
    if lacking := [str(path) for path, file in zip(paths, kept, strict=True) if not file.exists()]:
        sys.exit(f"host: {', '.join(lacking)} did not end; run it by pytest, then this again")
    return [test_file(*json.loads(file.read_text())) for file in kept]


def test_file(path: str, reached: list[str], tests: list[tuple[str, float, list[str]]]) -> TestFile:
    return TestFile(
        path, frozenset(reached), tuple(Test(name, seconds, frozenset(calls)) for name, seconds, calls in tests)
    )


def killer_of(mutant: PythonMutant, files: Sequence[TestFile]) -> str:
    """Return what the test says that fails with the mutant; nothing: it survives."""
    able = [(file, tests) for file in files if (tests := file.able(mutant))]
    if not able:  # a module without functions
        able = [(file, list(file.tests)) for file in files if f"{mutant.path}:{IMPORTED}" in file.reached]
    own = f"/{mutant.path.parent.name}/"
    able.sort(key=lambda pair: (own not in pair[0].path, sum(test.seconds for test in pair[1])))
    with tempfile.TemporaryDirectory() as folder:
        text, selected = Path(folder, "mutant.py"), Path(folder, "selected.json")
        text.write_text(text_with(ROOT, mutant), encoding="utf-8")
        environment = {"MUTANT_OF": str(ROOT / mutant.path), "MUTANT_TEXT": str(text), "SELECTED": str(selected)}
        for part in (able[:AT_FIRST], able[AT_FIRST:]):
            limits: dict[str, float | None] = {test.name: None for file, _ in part for test in file.tests}
            for name, seconds in [(test.name, test.seconds) for _, tests in part for test in tests]:
                limits.pop(name)
                limits[name] = PATIENCE * seconds + GRACE
            selected.write_text(json.dumps(limits))
            timeout = IMPORTING + sum(filter(None, limits.values()))
            if part and (fault := failure(["-x", *(file.path for file, _ in part)], environment, timeout)):
                return fault
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(prog="host", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, metavar="N")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the draw (default: %(default)s)")
    parser.add_argument("--list", action="store_true", help="say which are drawn, and run nothing")
    parser.add_argument("--only", default="", metavar="TEXT", help="those of the draw with this in their description")
    parser.add_argument("--json", type=Path, metavar="FILE", help="add the verdicts, leave out those that it has")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    equivalent = EQUIVALENT.read_text(encoding="utf-8").splitlines()
    all_drawn = drawn(ROOT, files_under(MUTATED, "*.py"), args.count, args.seed, equivalent)
    mutants = [each for each in all_drawn if args.only in str(each)]
    if args.list:
        print(*mutants, sep="\n")
        return 0
    tests = all_measured(ROOT / "build/tests/mutation/reached", args.jobs)
    verdicts: dict[str, str] = json.loads(args.json.read_text()) if args.json and args.json.exists() else {}
    with ThreadPoolExecutor(args.jobs) as pool:
        running = {pool.submit(killer_of, each, tests): each for each in mutants if each.name not in verdicts}
        for done in as_completed(running):
            print(f"{running[done]}\n    {done.result() or 'SURVIVES'}", flush=True)
            verdicts[running[done].name] = done.result()
            if args.json:
                args.json.write_text(json.dumps(verdicts, indent=1))
    print(f"{sum(bool(verdicts[each.name]) for each in mutants)} of {len(mutants)} mutants of seed {args.seed} killed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
