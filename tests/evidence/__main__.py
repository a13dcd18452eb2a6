"""Gathers what proves the firmware: build/evidence/evidence.json, and EVIDENCE.html for a reviewer.

    python tests/evidence BUILD

Proves by Eva, flies the fault matrix and a day of soak, fuzzes, measures coverage, runs the tests of
firmware/REQUIREMENTS.md and SECURITY.md and all mutants of the core. Both files are there when all of it could be
gathered; until then there is neither.

Exit status: 0 when each requirement has tests that passed, no fault is missed that is not known to be, and Eva, soak
and fuzzers find nothing; 1 when not, which the page shows; 2 when a part could not be gathered, and nothing is written.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from covered import __main__ as covered
from covered import measuring
from evidence import page, results
from evidence.results import EvidenceError
from fuzz import libfuzzer
from lever_cdkf.errors import LeverError
from lever_cdkf.runtime.files import Outputs, json_text
from lever_cdkf.runtime.provenance import provenance
from proof import eva
from quality import tools, tracing

Content = dict[str, Any]
TOOLS = (eva.PROGRAM, measuring.COMPILER, measuring.MERGER, measuring.READER)
FUZZED = 60
"""[s] a target."""
FILES = ("evidence.json", "EVIDENCE.html")


def main() -> int:
    parser = argparse.ArgumentParser(prog="evidence", description=__doc__.splitlines()[0])
    parser.add_argument("build", type=lambda path: Path(path).resolve())
    build = parser.parse_args().build
    folder = build / "evidence"
    for name in FILES:
        (folder / name).unlink(missing_ok=True)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            content = gather(build, Path(scratch))
        with Outputs(folder) as out:
            out.path("evidence.json").write_text(json_text(content), encoding="utf-8")
            out.path("EVIDENCE.html").write_text(page.build(content), encoding="utf-8")
            out.finish()
    except (EvidenceError, LeverError, measuring.CoverageError, eva.EvaError) as error:
        print(f"evidence: error: {error}; nothing is written", file=sys.stderr)
        return 2
    print(f"{page.verdict(content)}\nWritten to {folder}: {', '.join(FILES)}")
    return 0 if page.holds(content) else 1


def gather(build: Path, scratch: Path) -> Content:
    """Return all of it, the shortest part first. Raise EvidenceError, CoverageError or EvaError."""
    if missing := [tool for tool in TOOLS if shutil.which(tool) is None]:
        packages = tools.ROOT / "tests/setup/debian-packages.txt"
        raise EvidenceError(f"no {', '.join(missing)} here: install the packages of {packages}")
    content: Content = {}
    parts: dict[str, Callable[[], Content]] = {
        "eva": _eva,
        "fault_rows": lambda: _faults(build, scratch / "faults.json"),
        "soak": lambda: _soak(build, scratch / "soak.json"),
        "fuzz": lambda: _fuzz(build),
        "coverage": lambda: _coverage(build),
        "requirements": lambda: _requirements(build, scratch / "pytest.xml"),
        "mutants": lambda: _mutants(build / "tests/mutation", scratch / "mutants.json"),
    }
    seconds = {}
    for i, (name, part) in enumerate(parts.items()):
        print(f"-- {i + 1} of {len(parts)}: {name}", flush=True)
        start = time.monotonic()
        content[name] = part()
        seconds[name] = round(time.monotonic() - start, 1)
    content["eva_alarms"] = content["eva"].pop("alarms")
    content["seconds"] = seconds
    content["provenance"] = asdict(provenance())
    return content


def _run(command: Sequence[str | Path]) -> int:
    """Return a part that is a program; what it says is progress. Returns its status, which may be 1, "something is
    missed". Raises EvidenceError for another."""
    status = subprocess.run([str(word) for word in command], cwd=tools.ROOT, check=False).returncode
    if status not in (0, 1):
        raise EvidenceError(f"{Path(command[0]).name} {Path(command[1]).name} ended with status {status}")
    return status


def _read(file: Path) -> Content:
    if not file.exists():
        raise EvidenceError(f"{file.name} was not written")
    content: Content = json.loads(file.read_text(encoding="utf-8"))
    return content


def _eva() -> Content:
    proofs = {name: eva.prove(name) for name in eva.SOURCES}
    modules = [
        {"harness": name, "files": list(eva.SOURCES[name]), "alarms": proof.alarms, "reached": proof.reached}
        for name, proof in proofs.items()
    ]
    return {"alarms": sum(proof.alarms for proof in proofs.values()), "modules": modules}


def _faults(build: Path, file: Path) -> Content:
    """Return the matrix as `lever faults` has it."""
    _run([build / "venv/bin/lever", "faults", "--json", file])
    content = _read(file)
    return {name: content[name] for name in ("count", "missed", "unexpected", "silent", "rows")}


def _soak(build: Path, file: Path) -> Content:
    """Return a day without a reset, as `lever soak` has it."""
    _run([build / "venv/bin/lever", "soak", "--out", file.with_suffix(".html"), "--json", file])
    content = _read(file)
    return {name: content[name] for name in ("total", "memory_growth_mib", "troubles")} | {
        "hours": len(content["hours"])
    }


def _fuzz(build: Path) -> Content:
    """Return each fuzz target for a while, from a seed of now."""
    file = build / "fuzz.json"
    command: list[str | Path] = [
        *(sys.executable, tools.ROOT / "tests/fuzz", "--seconds", str(FUZZED)),
        *("--build", build / "fuzz", "--json", file),
    ]
    found = _run(command)
    seeds = {name: row["first_seed"] for name, row in _read(file)["targets"].items()}
    return {"targets": list(libfuzzer.SOURCES), "seconds": FUZZED, "seeds": seeds, "found": found}


def _coverage(build: Path) -> Content:
    found = measuring.measure(covered.sources(build), build / "covered")
    shares = {kind: round(found.share(kind), 2) for kind in found.count}
    excluded = [str(each) for each in found.missing if each.number]
    return {**shares, "counts": found.count, "excluded": excluded, "open": [str(each) for each in found.open]}


def _requirements(build: Path, report: Path) -> Content:
    """Return each with its tests and what they said."""
    required = tracing.requirements()
    said = results.of_c(build) | results.of_python(report)
    traced = tracing.traces()
    rows: list[Content] = []
    for number, words in required.items():
        keys = [(trace.path, trace.test) for trace in traced if trace.requirement == number]
        tests = [{"test": "::".join(key), **asdict(said.get(key, results.Said("not run")))} for key in keys]
        rows.append({"number": number, "requirement": words, "tests": tests})
    untested = sum({test["verdict"] for test in row["tests"]} != {"passed"} for row in rows)
    return {"count": len(rows), "untested": untested, "rows": rows}


def _mutants(build: Path, file: Path) -> Content:
    _run([sys.executable, tools.ROOT / "tests/mutation", build, "--json", file])
    content = _read(file)
    survivors = [each["mutant"] for each in content["verdicts"] if not each["killer"]]
    return {**{name: content[name] for name in ("valid", "killed", "equivalent")}, "survivors": survivors}


if __name__ == "__main__":
    sys.exit(main())
