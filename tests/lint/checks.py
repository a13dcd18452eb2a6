"""The linters and how each is called. A check returns its findings as text, which is empty where there are none."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
PYTHON_FOLDERS = ("firmware", "host_tools", "sil", "tests")

MISRA = (FIRMWARE / "MISRA.md").read_text(encoding="utf-8")
_EVERYWHERE, _POSIX = MISRA.split("## On a POSIX host")


def _rules(text: str) -> set[str]:
    """Return those in the first column of tables."""
    lists = re.findall(r"^\| (\d+\.\d+(?:, \d+\.\d+)*) \|", text, re.MULTILINE)
    return {f"misra-c2012-{rule}" for each in lists for rule in each.split(", ")}


NOT_APPLIED, NOT_ON_POSIX = _rules(_EVERYWHERE), _rules(_POSIX) | {"misra-config"}
"""cppcheck reads no headers of a system, and says by misra-config which of their names it does not know."""
DEVIATIONS: dict[str, str] = dict(re.findall(r"^\| (D\d+) \| (\d+\.\d+) \|", MISRA, re.MULTILINE))
"""Number and rule of each."""
CPPCHECK_FINDING = re.compile(
    r"^\S+?:\d+: (?:\S+ (?P<rule>misra-[\w.-]+|unmatchedSuppression)|(?:error|warning) \w+)$", re.MULTILINE
)


def _run(tool: str, *arguments: str | Path) -> tuple[bool, str]:
    """Return whether a tool of the virtual environment exits with 0, and what it says."""
    command = [str(Path(sys.executable).with_name(tool)), *map(str, arguments)]
    result = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return result.returncode == 0, result.stdout


def _said(passed: bool, output: str) -> str:
    return "" if passed else output or "it failed without a word\n"


def layout(*files: str | Path) -> str:
    """C files are laid out as .clang-format says."""
    return _said(*_run("clang-format", "--dry-run", "--Werror", f"--style=file:{ROOT}/.clang-format", *files))


def tidy(database: str | Path, file: str | Path, *options: str) -> str:
    """Check that a C file of a compilation database is clean under .clang-tidy."""
    configuration = f"--config-file={ROOT}/.clang-tidy"
    return _said(*_run("clang-tidy", "--quiet", configuration, "-p", database, *options, file))


def tidy_cross(database: str | Path, file: str | Path) -> str:
    """Return the same of a file for the microcontroller: clang speaks for its processor, and reads the C library of
    gcc."""
    gcc = ["arm-none-eabi-gcc", "-print-sysroot"]
    sysroot = subprocess.run(gcc, capture_output=True, text=True, check=True).stdout.strip()
    headers = (f"{sysroot}/include/newlib", f"{sysroot}/include", "/usr/include/newlib")
    options = ("--target=thumbv7em-none-eabihf", *(f"-isystem{folder}" for folder in headers))
    return tidy(database, file, *(f"--extra-arg={option}" for option in options))


def misra(*files: str | Path, without: AbstractSet[str] = frozenset()) -> str:
    """C files keep to MISRA C:2012, by cppcheck's add-on, but for what firmware/MISRA.md names; nor has cppcheck itself
    anything to warn of.

    That page says which advisory rules are not applied, and numbers each deviation from the others. A deviation is
    suppressed on the line where it is, with its number. cppcheck's exit status says nothing reliable, so its output is
    read.
    """
    options = ("--addon=misra", "--std=c99", "--quiet", "--inline-suppr", "--enable=style,warning,information")
    without_assertions = "-ULEVER_ASSERTIONS"
    template = "--template={file}:{line}: {severity} {id}"
    with tempfile.TemporaryDirectory() as scratch:  # otherwise its dumps are written beside the sources
        places = (f"--cppcheck-build-dir={scratch}", "-I", FIRMWARE)
        _, output = _run("cppcheck", *options, without_assertions, template, *places, *files)
    found = [match[0] for match in CPPCHECK_FINDING.finditer(output) if match["rule"] not in NOT_APPLIED | without]
    return "\n".join(["fix, or suppress as firmware/MISRA.md says:", *found, ""]) if found else ""


def misra_image(build_headers: str, *files: str | Path) -> str:
    """Return the same of all the files of an image for the microcontroller beside the core, as they are compiled for
    it."""
    return misra("-D__arm__", f"-I{build_headers}", *files)


def misra_posix(*files: str | Path) -> str:
    """Return the same of the port to POSIX, but for what the page names for it."""
    return misra("--library=posix", *files, without=NOT_ON_POSIX)


def analyzer(build_headers: str, *files: str | Path) -> str:
    """gcc's static analyzer finds nothing in C files: in those of the microcontroller with its compiler."""
    said = ""
    for file in map(str, files):
        cross = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
        compiler = cross if "/port/stm32f4/" in file else ["gcc"]
        options = ("-std=c99", "-O2", "-fanalyzer", "-Werror", f"-I{FIRMWARE}", f"-I{build_headers}")
        command = [*compiler, *options, "-c", file, "-o", os.devnull]
        result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        said += _said(result.returncode == 0, result.stderr)
    return said


def python() -> str:
    """Check that the Python files are laid out by ruff, and clean under its checks."""
    return _said(*_run("ruff", "format", "--check", "--diff", *PYTHON_FOLDERS)) + _said(
        *_run("ruff", "check", *PYTHON_FOLDERS)
    )


def types(build_dir: str | Path) -> str:
    """Check that the Python files are fully typed."""
    if sys.version_info < (3, 11):
        return "the numpy for Python 3.10 declares other types\n" if os.environ.get("LEVER_REQUIRE_ALL") == "1" else ""
    return _said(*_run("mypy", f"--cache-dir={build_dir}/mypy"))


def suppressed(texts: Iterable[str]) -> tuple[dict[str, str], int]:
    """Return number and rule of the MISRA deviations that C texts suppress, and how many suppressions have no
    number."""
    numbered = re.compile(r"cppcheck-suppress\s+misra-c2012-(?P<rule>\d+\.\d+)\s*;\s*(?P<number>D\d+)\s*\*/")
    found: dict[str, str] = {}
    without = 0
    for text in texts:
        matches = list(numbered.finditer(text))
        found |= {match["number"]: match["rule"] for match in matches}
        without += text.count("cppcheck-suppress") - len(matches)
    return found, without
