"""Which mutants the unit tests kill: each test program that reaches a mutant runs with it until one fails."""

from __future__ import annotations

import os
import resource
import subprocess
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from subprocess import DEVNULL

from .schemata import Mutant

PATIENCE = 10
"""A mutant hangs when a program evaluates so many times as many expressions as without."""
GRACE = 1_000_000


@dataclass(frozen=True)
class Program:
    """A program of tests, or one with one case, as it runs without a mutant."""

    command: tuple[Path, ...]
    seconds: float
    expressions: int
    """Evaluated that could have held a mutant."""
    reached: frozenset[int]
    """Mutant.guard of those."""
    patience: float = PATIENCE

    @property
    def name(self) -> str:
        return self.command[-1].name

    def kills(self, mutant: Mutant) -> bool:
        environment = {
            "MUTANT": str(mutant.number),
            "MUTANT_MOST": str(round(self.patience * self.expressions) + GRACE),
        }
        return _run(self.command, environment) != 0


def _run(command: tuple[Path, ...], environment: dict[str, str]) -> int:
    with tempfile.TemporaryDirectory() as folder:
        everything = os.environ | environment
        return subprocess.run(
            command, cwd=folder, env=everything, stdout=DEVNULL, stderr=DEVNULL, check=False
        ).returncode


def measured(*command: Path) -> Program:
    """Runs it without a mutant. Raises RuntimeError when it fails."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report"
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        if _run(command, {"MUTANT_REPORT": str(report)}) != 0:
            raise RuntimeError(f"{' '.join(map(str, command))} fails without a mutant")
        seconds = 0.005 + resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        expressions, *reached = map(int, report.read_text().split())
    return Program(command, seconds, expressions, frozenset(reached))


@dataclass(frozen=True)
class Verdict:
    mutant: Mutant
    killer: str
    """Program that fails; none: the mutant survives."""
    reached: bool


def judged(mutants: Sequence[Mutant], programs: Sequence[Program], jobs: int) -> Iterator[Verdict]:
    """The verdict on each mutant, in the order of `mutants`. What killed others of the same function is tried first."""
    kills: dict[tuple[str, str], dict[str, int]] = defaultdict(lambda: defaultdict(int))

    def judge(mutant: Mutant) -> Verdict:
        record = kills[(mutant.path, mutant.function)]
        able = [program for program in programs if mutant.guard in program.reached]
        for program in sorted(able, key=lambda p: p.seconds / (1 + record[p.name])):
            if program.kills(mutant):
                record[program.name] += 1
                return Verdict(mutant, program.name, True)
        return Verdict(mutant, "", bool(able))

    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(judge, mutants)
