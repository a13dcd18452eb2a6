"""What the tests of the requirements say when they are run: by their file and name, "passed", "failed" or "skipped"."""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from quality import tools, tracing

Said = dict[tuple[str, str], str]
_WORSE = ("passed", "skipped", "failed")


def of_python(report: Path) -> Said:
    """Runs the marked tests of Python."""
    files = sorted({trace.path for trace in tracing.traces() if trace.path.endswith(".py")})
    tools.run([sys.executable, "-m", "pytest", "-q", "-m", "requirement", f"--junitxml={report}", *files])
    return read(report.read_text(encoding="utf-8"))


def read(report: str) -> Said:
    """From pytest's JUnit file; of a test with parameters the worst."""
    said: Said = {}
    for case in ElementTree.fromstring(report).iter("testcase"):
        path = case.get("classname", "").replace(".", "/") + ".py"
        kinds = {child.tag for child in case}
        verdict = "failed" if kinds & {"failure", "error"} else "skipped" if "skipped" in kinds else "passed"
        key = path, case.get("name", "").partition("[")[0]
        said[key] = max(said.get(key, "passed"), verdict, key=_WORSE.index)
    return said


def of_c(build: Path) -> Said:
    """Runs the programs of the marked tests in C, each line of which says `file:line:test:PASS` or FAIL."""
    said: Said = {}
    for path in sorted({trace.path for trace in tracing.traces() if trace.path.endswith(".c")}):
        module, name = Path(path).parts[-2], Path(path).stem.removeprefix("test_")
        for line in tools.run([build / f"tests/unit.{module}.{name}"]).stdout.splitlines():
            if found := re.match(r".*?:\d+:(\w+)(?: \[\d+\])?:(PASS|FAIL)", line):
                verdict = "passed" if found[2] == "PASS" else "failed"
                said[path, found[1]] = max(said.get((path, found[1]), "passed"), verdict, key=_WORSE.index)
    return said
