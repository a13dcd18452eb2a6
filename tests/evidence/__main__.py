"""Gathers what proves the firmware: build/evidence/evidence.json, and EVIDENCE.html for a reviewer.

    python tests/evidence BUILD [--mutants FILE]

Runs the tests of firmware/REQUIREMENTS.md, measures coverage, proves by Eva, and flies the fault matrix; FILE holds the
verdicts on mutants, as tests/mutation writes them. Exit status: 0 when each requirement has a test that passed.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from covered import __main__ as covered
from covered import measuring
from evidence import page, results
from lever_cdkf.host_tools.provenance import provenance
from proof import eva
from quality import tools, tracing

Content = dict[str, Any]


def main() -> int:
    parser = argparse.ArgumentParser(prog="evidence", description=__doc__.splitlines()[0])
    parser.add_argument("build", type=lambda path: Path(path).resolve())
    parser.add_argument("--mutants", type=Path, metavar="FILE", help="verdicts on mutants")
    args = parser.parse_args()
    folder = args.build / "evidence"
    folder.mkdir(exist_ok=True)
    parts: dict[str, Callable[[], Content]] = {
        "requirements": lambda: _requirements(args.build, folder),
        "coverage": lambda: _coverage(args.build),
        "eva": _eva,
        "fault_rows": lambda: _faults(args.build, folder),
        "mutants": lambda: _mutants(args.mutants),
    }
    content: Content = {}
    for name, gather in parts.items():
        print(f"-- {name}", flush=True)
        content[name] = gather()
    content["eva_alarms"] = content["eva"].pop("alarms", None)
    content["provenance"] = asdict(provenance())
    (folder / "evidence.json").write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    (folder / "EVIDENCE.html").write_text(page.build(content), encoding="utf-8")
    untested = content["requirements"]["untested"]
    print(f"Written to {folder}: evidence.json, EVIDENCE.html; requirements without a test that passed: {untested}")
    return 1 if untested else 0


def _requirements(build: Path, folder: Path) -> Content:
    """Each with its tests and what they said."""
    required = tracing.requirements((tools.FIRMWARE / "REQUIREMENTS.md").read_text(encoding="utf-8"))
    said = results.of_python(folder / "pytest.xml") | results.of_c(build)
    rows = []
    for number, words in required.items():
        tests = [trace for trace in tracing.traces() if trace.requirement == number]
        shown = {f"{trace.path}::{trace.test}": said.get((trace.path, trace.test), "not run") for trace in tests}
        rows.append({"number": number, "requirement": words, "tests": shown})
    untested = sum(set(row["tests"].values()) != {"passed"} for row in rows)  # type: ignore[attr-defined]
    return {"count": len(rows), "untested": untested, "rows": rows}


def _coverage(build: Path) -> Content:
    if shutil.which(measuring.READER) is None:
        return {"missing": f"no {measuring.READER} here"}
    found = measuring.measure(covered.sources(build), build / "covered")
    shares = {kind: round(found.share(kind), 2) for kind in found.count}
    excluded = [str(each) for each in found.missing if each.number]
    return {**shares, "counts": found.count, "excluded": excluded, "open": [str(each) for each in found.open]}


def _eva() -> Content:
    if shutil.which(eva.PROGRAM) is None:
        return {"missing": f"no {eva.PROGRAM} here"}
    proofs = {name: eva.prove(name) for name in eva.SOURCES}
    alarms = sum(proof.alarms for proof in proofs.values())
    return {"alarms": alarms, "modules": {name: list(eva.SOURCES[name]) for name in proofs}}


def _faults(build: Path, folder: Path) -> Content:
    """The matrix as `lever faults` has it."""
    rows = folder / "faults.json"
    result = tools.run([build / "venv/bin/lever", "faults", "--json", rows])
    if result.returncode not in (0, 1):
        raise RuntimeError(result.stdout)
    content: Content = json.loads(rows.read_text(encoding="utf-8"))
    return {name: content[name] for name in ("count", "missed", "silent", "rows")}


def _mutants(file: Path | None) -> Content:
    if file is None:
        return {"missing": "not run"}
    verdicts = json.loads(file.read_text(encoding="utf-8"))
    survivors = [each["mutant"] for each in verdicts if not each["killer"]]
    return {"valid": len(verdicts), "killed": len(verdicts) - len(survivors), "survivors": survivors}


if __name__ == "__main__":
    sys.exit(main())
