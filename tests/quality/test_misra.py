"""MISRA C:2012 over the firmware core, by cppcheck's add-on.

firmware/MISRA.md says which advisory rules are not applied, and numbers each deviation from the others; a deviation is
suppressed on the line where it is, with its number. Whoever adds one without the other fails here. cppcheck's exit
status says nothing reliable, so its output is read.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import pytest
from quality import tools

MISRA = (tools.FIRMWARE / "MISRA.md").read_text(encoding="utf-8")
FINDING = re.compile(
    r"^(?P<file>[^:\s]+):(?P<line>\d+): \S+ (?P<rule>misra-[\w.-]+|unmatchedSuppression)", re.MULTILINE
)
SUPPRESSION = re.compile(r"cppcheck-suppress\s+misra-c2012-(?P<rule>\d+\.\d+)\s*;\s*(?P<number>D\d+)\s*\*/")


def not_applied() -> list[str]:
    return re.findall(r"^\| (\d+\.\d+) \|", MISRA, re.MULTILINE)


def deviations() -> dict[str, str]:
    """Number and rule of each."""
    return dict(re.findall(r"^\| (D\d+) \| (\d+\.\d+) \|", MISRA, re.MULTILINE))


def findings(sources: Iterable[Path]) -> list[str]:
    """file:line rule, of what is neither suppressed nor against a rule that is not applied."""
    cppcheck = [
        tools.python_tool("cppcheck"),
        "--addon=misra",
        "--std=c99",
        "--quiet",
        "--inline-suppr",
    ]
    options: list[str | Path] = [
        "--enable=style,information",
        "--template={file}:{line}: {severity} {id}",
        "-I",
        tools.FIRMWARE,
    ]
    output = tools.run([*cppcheck, *options, *sources]).stdout
    ignored = {f"misra-c2012-{rule}" for rule in not_applied()}
    found = [match for match in FINDING.finditer(output) if match["rule"] not in ignored]
    return [f"{match['file']}:{match['line']} {match['rule']}" for match in found]


def test_core() -> None:
    found = findings(tools.core_sources())
    if found:
        pytest.fail("\n".join(["fix, or suppress as firmware/MISRA.md says:", *found]), pytrace=False)


def test_every_deviation_is_documented_and_used() -> None:
    texts = [file.read_text(encoding="utf-8") for file in tools.c_files() if tools.FIRMWARE in file.parents]
    suppressed = {match["number"]: match["rule"] for text in texts for match in SUPPRESSION.finditer(text)}
    unnumbered = [text for text in texts if text.count("cppcheck-suppress") != len(SUPPRESSION.findall(text))]
    assert suppressed == deviations()
    assert not unnumbered, "a suppression without a number"


def test_seeded_violations_are_found(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(
        "#include <stdint.h>\n"
        "extern uint32_t seeded(uint32_t x);\n"
        "uint32_t seeded(uint32_t x)\n"
        "{\n"
        "    uint32_t y = 010;\n"
        "    if (x > 1u)\n"
        "        y = seeded(x - 1u);\n"
        "    return y;\n"
        "}\n"
    )
    assert {finding.split()[1] for finding in findings([seeded])} >= {
        "misra-c2012-7.1",
        "misra-c2012-15.6",
        "misra-c2012-17.2",
    }
