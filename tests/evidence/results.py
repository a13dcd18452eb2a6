"""What the tests of the requirements say when they are run, by their file and name."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

from quality import tools, tracing

_WORSE = ("passed", "skipped", "failed")


class EvidenceError(Exception):
    """A part of the evidence could not be gathered."""


@dataclass
class Said:
    """By a test, in all its cases."""

    verdict: str = "passed"
    """The worst: "passed", "skipped" or "failed"."""
    cases: int = 0
    figures: dict[str, list[str]] = field(default_factory=dict)
    """What a test in Python measured: the values that it gave to record_property()."""

    def add(self, verdict: str) -> None:
        """Of one case."""
        self.verdict = max(self.verdict, verdict, key=_WORSE.index)
        self.cases += 1


ByTest = dict[tuple[str, str], Said]


def of_python(report: Path) -> ByTest:
    """Run the marked tests of Python, which leave `report`. Raises EvidenceError."""
    files = sorted({trace.path for trace in tracing.traces() if trace.path.endswith(".py")})
    command = [sys.executable, "-m", "pytest", "-q", "--tb=short", "-m", "requirement", f"--junitxml={report}", *files]
    status = subprocess.run(command, cwd=tools.ROOT, check=False).returncode
    if status not in (0, 1) or not report.exists():
        raise EvidenceError(f"pytest ended with status {status}")
    return read(report.read_text(encoding="utf-8"))


def read(report: str) -> ByTest:
    """From pytest's JUnit file."""
    said: ByTest = {}
    for case in ElementTree.fromstring(report).iter("testcase"):
        path = case.get("classname", "").replace(".", "/") + ".py"
        kinds = {child.tag for child in case}
        test = said.setdefault((path, case.get("name", "").partition("[")[0]), Said())
        test.add("failed" if kinds & {"failure", "error"} else "skipped" if "skipped" in kinds else "passed")
        for each in case.iter("property"):
            test.figures.setdefault(each.get("name", ""), []).append(each.get("value", ""))
    return said


def of_c(build: Path) -> ByTest:
    """Run the programs of the marked tests in C, each line of which says `file:line:test:PASS` or FAIL. Raises
    EvidenceError."""
    said: ByTest = {}
    for path in sorted({trace.path for trace in tracing.traces() if trace.path.endswith(".c")}):
        module, name = Path(path).parts[-2], Path(path).stem.removeprefix("test_")
        program = build / f"tests/unit.{module}.{name}"
        if not program.exists():
            raise EvidenceError(f"{program} is not built")
        for line in tools.run([program]).stdout.splitlines():
            if match := re.match(r".*?:\d+:(\w+)(?: \[\d+\])?:(PASS|FAIL)", line):
                said.setdefault((path, match[1]), Said()).add("passed" if match[2] == "PASS" else "failed")
    return said
