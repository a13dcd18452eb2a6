"""The core computes the same bits whatever compiles it, and reads no memory that it has not written.

The program of embedded/ is built with gcc and clang, without and with all optimisation, and once more for the very
processor that runs this (which may have fused multiply-adds to be tempted by); warnings are errors. All builds must
print the same estimates.
"""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from quality import tools

SAMPLES = 3000
QUIET = "-Wno-unknown-warning-option -Wno-invalid-feature-combination"
"""Clang knows better than the newest processors what they have, and says so; gcc knows neither warning."""
BUILDS = [
    pytest.param(compiler, flags, id=f"{compiler.split('|')[0]} {flags}", marks=pytest.mark.requires(compiler))
    for compiler in ("gcc", "clang-19|clang")
    for flags in ("-O0", "-O3", f"-O3 -march=native {QUIET}")
]


def build(compiler: str, flags: str, folder: Path) -> Path:
    """The program, built in the folder."""
    setting = [f"-DCMAKE_C_COMPILER={tools.first_installed(compiler)}", f"-DCMAKE_C_FLAGS={flags}"]
    plain = ["-DCMAKE_BUILD_TYPE=", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON"]
    tools.assert_silent(["cmake", "-S", Path(__file__).with_name("embedded"), "-B", folder, *setting, *plain])
    tools.assert_silent(["cmake", "--build", folder, "--parallel", "2"])
    return folder / "embedded"


def output(program: Path) -> list[str]:
    result = tools.run([program, str(SAMPLES)])
    assert result.returncode == 0, result.stdout
    return result.stdout.splitlines()


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return output(build("cc|gcc|clang", "-O1", tmp_path_factory.mktemp("reference")))


def test_the_program_exercises_the_filter(reference: list[str]) -> None:
    """Otherwise equal output would prove little: every run must leave its first guess, with finite numbers."""
    runs = {line.split()[0] for line in reference}
    assert len(reference) == SAMPLES * len(runs)
    for run in runs:
        lines = [line.split() for line in reference if line.split()[0] == run]
        assert lines[-1][2] == "2", "not in mode run"
        for first, last in zip(lines[0][7:13:2], lines[-1][7:13:2], strict=True):
            start, end = (struct.unpack(">f", bytes.fromhex(bits))[0] for bits in (first, last))
            assert start != 0.0
            assert 0.01 < abs(end / start - 1.0) < 10.0


@pytest.mark.parametrize(("compiler", "flags"), BUILDS)
def test_same_bits(reference: list[str], compiler: str, flags: str, tmp_path: Path) -> None:
    lines = output(build(compiler, flags, tmp_path))
    assert len(lines) == len(reference)
    differing = [pair for pair in zip(reference, lines, strict=True) if pair[0] != pair[1]]
    assert not differing, "first difference:\n" + "\n".join(differing[0])


@pytest.mark.requires("valgrind")
def test_no_uninitialised_memory_is_read(tmp_path: Path) -> None:
    program = build("cc|gcc|clang", "-O1 -g", tmp_path)
    tools.assert_silent(["valgrind", "--quiet", "--error-exitcode=1", "--track-origins=yes", program, "300"])
