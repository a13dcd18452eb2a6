"""What of the core the unit tests reach, by clang's source-based coverage: lines, branches, and conditions (MC/DC)."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
COMPILER, MERGER, READER = "clang-19", "llvm-profdata-19", "llvm-cov-19"
COVERAGE = ("-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc")
FLIGHTS = ROOT / "tests/quality/embedded"
EXCLUSIONS = ROOT / "firmware/COVERAGE.md"


class CoverageError(Exception):
    """A program that cannot be built or run."""


class Exclusion(NamedTuple):
    """A row of EXCLUSIONS: lines of a file with these words."""

    number: str
    path: str
    words: str


@cache
def exclusions() -> list[Exclusion]:
    rows = re.findall(r"^\| (C\d+) \| `(.+?)` \| `(.+?)` \|", EXCLUSIONS.read_text(encoding="utf-8"), re.MULTILINE)
    return [Exclusion(*row) for row in rows]


@dataclass(frozen=True)
class Missing:
    """Something that no test reaches."""

    kind: str
    path: str
    line: int
    what: str
    number: str
    """Of its exclusion, if it has one."""

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.what}{f' ({self.number})' if self.number else ''}"


@dataclass
class Coverage:
    """How many lines, branches and conditions there are, and what is missing of each."""

    count: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("lines", "branches", "mcdc"), 0))
    missing: list[Missing] = field(default_factory=list)

    def share(self, kind: str) -> float:
        """Return the share of the kind reached, of what is not excluded [%]."""
        excluded = sum(each.kind == kind and bool(each.number) for each in self.missing)
        missed = sum(each.kind == kind for each in self.open)
        return 100.0 * (1.0 - missed / (self.count[kind] - excluded))

    @property
    def open(self) -> list[Missing]:
        """Missing and not excluded."""
        return [each for each in self.missing if not each.number]


@dataclass(frozen=True)
class Sources:
    """What the programs are made of."""

    core: Sequence[Path]
    other: Sequence[Path]
    tests: Sequence[Path]
    flags: Sequence[str]
    build: Path | None = None
    """With the cases of the float64 oracle; None: neither these nor the flights are run."""


def measure(sources: Sources, folder: Path) -> Coverage:
    """Build every test in C, run all, and read what they have reached. Raise CoverageError."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    core = _each(sources.core, lambda source: _compiled(source, folder, [*sources.flags, "-fPIC", *COVERAGE]))
    other = _each(sources.other, lambda source: _compiled(source, folder, sources.flags))
    tests = _each(sources.tests, lambda source: _compiled(source, folder, sources.flags))
    archive = folder / "tested.a"
    _run(["ar", "rcs", archive, *core, *other])
    programs = _each(tests, lambda test: _linked(test, archive))
    _each(programs, lambda program: _profiled([program], folder))
    if sources.build is not None:
        programs.append(_with_flights(sources, archive, folder))
        programs.append(_with_oracle(sources, core, folder))
    merged = folder / "all.profdata"
    _run([MERGER, "merge", "-sparse", *folder.glob("*.profraw"), "-o", merged])
    objects = [word for program in programs[1:] for word in ("-object", program)]
    export = _run([READER, "export", f"-instr-profile={merged}", programs[0], *objects])
    return read(json.loads(export)["data"][0]["files"], {str(source) for source in _with_headers(sources.core)})


def _with_flights(sources: Sources, archive: Path, folder: Path) -> Path:
    """Return the program whose bits are kept."""
    flights = _each(FLIGHTS.glob("*.c"), lambda source: _compiled(source, folder, sources.flags))
    program = folder / "flights"
    _run([COMPILER, *COVERAGE[:1], *flights, archive, "-lm", "-o", program])
    return _profiled([program, FLIGHTS / "golden.txt"], folder)


def _with_oracle(sources: Sources, core: Sequence[Path], folder: Path) -> Path:
    """Return the program that compares with the float64 oracle, in every case."""
    program = folder / "oracle"
    source = _compiled(ROOT / "tests/mutation/oracle.c", folder, sources.flags)
    _run([COMPILER, *COVERAGE[:1], source, *core, "-lm", "-o", program])
    assert sources.build is not None
    cases = sorted((sources.build / "tests/mutation/cases").glob("*.case"))
    _each(cases, lambda case: _profiled([program, case], folder))
    return program


def _with_headers(core: Sequence[Path]) -> list[Path]:
    return [*core, *(header for folder in {source.parent for source in core} for header in folder.glob("*.h"))]


def _each(items: Iterable[Path], work: Callable[[Path], Path]) -> list[Path]:
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, items))


def _run(command: Sequence[str | Path], **environment: str) -> str:
    words = [str(word) for word in command]
    result = subprocess.run(words, capture_output=True, text=True, check=False, env={**os.environ, **environment})
    if result.returncode != 0:
        raise CoverageError(f"{' '.join(words)[:200]}\n{result.stdout[-2000:]}{result.stderr[-2000:]}")
    return result.stdout


def _compiled(source: Path, folder: Path, flags: Sequence[str]) -> Path:
    """Return the object, optimised where it is measured: what tests it takes longer to compile than to run."""
    output = folder / ("_".join(source.parts[-3:]) + ".o")
    optimised = "-O1" if COVERAGE[0] in flags else "-O0"
    _run([COMPILER, *flags, optimised, "-g0", "-c", source, "-o", output])
    return output


def _linked(test: Path, archive: Path) -> Path:
    program = test.with_suffix("")
    _run([COMPILER, *COVERAGE[:1], test, archive, "-lm", "-o", program])
    return program


def _profiled(command: Sequence[Path], folder: Path) -> Path:
    _run(command, LLVM_PROFILE_FILE=str(folder / f"{command[-1].stem}-%m-%p.profraw"))
    return command[0]


# --- reading ---------------------------------------------------------------------------------------------------------

Place = tuple[int, int, int, int]


def read(files: Iterable[dict[str, Any]], paths: set[str]) -> Coverage:
    """From llvm-cov's export, of the files with these paths. An inline function counts once."""
    found = Coverage()
    for file in sorted(files, key=lambda each: str(each["filename"])):
        if file["filename"] in paths:
            text = Path(file["filename"]).read_text(encoding="utf-8").splitlines()
            _Reader(file, os.path.relpath(file["filename"], ROOT), text, found).all()
    return found


class _Reader:
    def __init__(self, file: dict[str, Any], path: str, text: Sequence[str], found: Coverage) -> None:
        self.file, self.path, self.text, self.found = file, path, text, found

    def all(self) -> None:
        self._lines()
        self._branches()
        self._conditions()

    def _miss(self, kind: str, line: int, what: str) -> None:
        own = [
            each for each in exclusions() if self.path == f"firmware/{each.path}" and each.words in self.text[line - 1]
        ]
        self.found.missing.append(Missing(kind, self.path, line, what, own[0].number if own else ""))

    def _lines(self) -> None:
        """Count a line as reached when any code on it is."""
        reached = line_counts(self.file["segments"], len(self.text))
        self.found.count["lines"] += len(reached)
        for line, count in reached.items():
            if count == 0:
                self._miss("lines", line, "never reached")

    def _branches(self) -> None:
        counts: dict[Place, list[int]] = {}
        for first, column, last, end, true, false, *_ in self.file["branches"]:
            both = counts.setdefault((first, column, last, end), [0, 0])
            both[0] += true
            both[1] += false
        self.found.count["branches"] += 2 * len(counts)
        for place, both in counts.items():
            for name, count in zip(("true", "false"), both, strict=True):
                if count == 0:
                    self._miss("branches", place[0], f"{self._words(place)}: never {name}")

    def _conditions(self) -> None:
        shown: dict[Place, list[bool]] = {}
        for record in self.file["mcdc_records"]:
            place, conditions = tuple(record[:4]), record[-1]
            before = shown.setdefault(place, [False] * len(conditions))
            shown[place] = [one or other for one, other in zip(before, conditions, strict=True)]
        for place, conditions in shown.items():
            self.found.count["mcdc"] += len(conditions)
            for i, covered in enumerate(conditions):
                if not covered:
                    what = f"{self._words(place)}: condition {i + 1} decides nothing by itself"
                    self._miss("mcdc", place[0], what)

    def _words(self, place: Place) -> str:
        first, column, last, end = place
        text = self.text[first - 1][column - 1 : end - 1 if last == first else None]
        return text.strip()


def line_counts(segments: Sequence[Sequence[Any]], lines: int) -> dict[int, int]:
    """Return how often each line with code is executed: the greatest count of what begins on it or goes on over it."""
    starting: dict[int, list[Sequence[Any]]] = {}
    for segment in segments:
        starting.setdefault(segment[0], []).append(segment)
    counts: dict[int, int] = {}
    over: Sequence[Any] | None = None
    for line in range(1, lines + 1):
        own = starting.get(line, [])
        entered = [each for each in own if each[3] and each[4]]
        going_on = over is not None and over[3]
        if (going_on or entered) and not (own and not own[0][3] and not entered and not going_on):
            values = [each[2] for each in entered] + ([over[2]] if going_on and over is not None else [])
            counts[line] = max(values)
        if own:
            over = own[-1]
    return counts
