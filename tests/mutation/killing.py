"""Which mutants the tests kill: each case that reaches a mutant runs with it until one fails."""

from __future__ import annotations

import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from threading import local
from typing import NamedTuple

from .schemata import Mutant

PATIENCE = 10
"""A mutant hangs when a case evaluates so many times as many expressions as without."""
GRACE = 100_000
START = 0.0005
"""What a case costs beside its own time [s]."""


class Test(NamedTuple):
    """A program of mutant.c with the arguments of one case."""

    program: Path
    arguments: tuple[str, ...]
    name: str


@dataclass(frozen=True)
class Case:
    """A test as it runs without a mutant."""

    test: Test
    seconds: float
    expressions: int
    """Evaluated that could have held a mutant."""
    reached: frozenset[int]
    """Mutant.guard of those."""


@dataclass(frozen=True)
class Verdict:
    mutant: Mutant
    killer: str
    """Test that fails; none: the mutant survives."""
    reached: bool


class Servers:
    """The programs of one thread; each is started when it is first needed."""

    def __init__(self, stack: ExitStack) -> None:
        self.stack = stack
        self.running: dict[Path, subprocess.Popen[str]] = {}
        self.folder = stack.enter_context(tempfile.TemporaryDirectory())

    def run(self, test: Test, mutant: int, most: int) -> list[int]:
        """Exit status, microseconds, expressions, and without a mutant the guards reached."""
        server = self.running.get(test.program) or self._start(test.program)
        assert server.stdin is not None
        assert server.stdout is not None
        server.stdin.write("\t".join((str(mutant), str(most), *test.arguments)) + "\n")
        server.stdin.flush()
        return [int(word) for word in server.stdout.readline().split("\t")]

    def _start(self, program: Path) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        server = subprocess.Popen([program], cwd=self.folder, stdin=pipe, stdout=pipe, text=True)
        self.running[program] = self.stack.enter_context(server)
        return server


class Judge:
    """Runs tests with and without mutants, so many at a time."""

    def __init__(self, jobs: int) -> None:
        self.stack = ExitStack()
        self.pool = self.stack.enter_context(ThreadPoolExecutor(jobs))
        self.own = local()
        self.tried: Counter[tuple[str, str]] = Counter()
        """By function (none: any) and test."""
        self.killed: Counter[tuple[str, str]] = Counter()

    def __enter__(self) -> Judge:
        return self

    def __exit__(self, *_: object) -> None:
        self.stack.close()

    def _run(self, test: Test, mutant: int, most: int) -> list[int]:
        if not hasattr(self.own, "servers"):
            self.own.servers = Servers(self.stack)
        answer: list[int] = self.own.servers.run(test, mutant, most)
        return answer

    def measured(self, tests: Sequence[Test]) -> list[Case]:
        """Run each without a mutant. Raise RuntimeError when one fails."""
        return list(self.pool.map(self._measure, tests))

    def _measure(self, test: Test) -> Case:
        status, microseconds, expressions, *reached = self._run(test, 0, 2**60)
        if status != 0:
            raise RuntimeError(f"{test.name} fails without a mutant")
        return Case(test, START + 1e-6 * microseconds, expressions, frozenset(reached))

    def verdicts(self, mutants: Sequence[Mutant], cases: Sequence[Case]) -> Iterator[Verdict]:
        """In the order of `mutants`."""
        return self.pool.map(lambda mutant: self._verdict(mutant, cases), mutants)

    def _verdict(self, mutant: Mutant, cases: Sequence[Case]) -> Verdict:
        """Return those cases come first that promise most for their time."""
        function = f"{mutant.path}:{mutant.function}"
        able = [case for case in cases if mutant.guard in case.reached]
        for case in sorted(able, key=lambda case: case.seconds / self._promise(function, case.test.name)):
            fails = self._run(case.test, mutant.number, PATIENCE * case.expressions + GRACE)[0] != 0
            for place in ("", function):
                self.tried[place, case.test.name] += 1
                self.killed[place, case.test.name] += fails
            if fails:
                return Verdict(mutant, case.test.name, True)
        return Verdict(mutant, "", bool(able))

    def _promise(self, function: str, test: str) -> float:
        """Return how probably it kills: what it has killed of the same function counts, and of all."""
        overall = (self.killed["", test] + 0.5) / (self.tried["", test] + 1)
        return (self.killed[function, test] + overall) / (self.tried[function, test] + 1)
