"""The core computes the same bits whatever compiles and runs it, and reads no memory that it has not written.

The program of embedded/ is built with gcc and clang, without and with all optimisation, once more for the very
processor that runs this (which may have fused multiply-adds to be tempted by), and for a big-endian MIPS; warnings are
errors. All builds must print the same estimates and frames. The unit tests of the core pass on the MIPS, too.
"""

from __future__ import annotations

import re
import struct
import sys
from pathlib import Path

import pytest
from quality import tools

SAMPLES = 3000
QUIET = "-Wno-unknown-warning-option -Wno-invalid-feature-combination"
"""Clang knows better than the newest processors what they have, and says so; gcc knows neither warning."""
BIG_ENDIAN = ("mips-linux-gnu-gcc", "qemu-mips-static")
CROSS = ["-DCMAKE_SYSTEM_NAME=Linux", "-DCMAKE_SYSTEM_PROCESSOR=mips", "-DCMAKE_EXE_LINKER_FLAGS=-static"]
BUILDS = [
    pytest.param(compiler, flags, id=f"{compiler.split('|')[0]} {flags}", marks=pytest.mark.requires(compiler))
    for compiler in ("gcc", "clang-19|clang")
    for flags in ("-O0", "-O3", f"-O3 -march=native {QUIET}")
] + [
    pytest.param(BIG_ENDIAN[0], flags, id=f"mips {flags}", marks=pytest.mark.requires(*BIG_ENDIAN))
    for flags in ("-O0", "-O3")
]


def build(source: str, compiler: str, flags: str, folder: Path, *settings: str) -> None:
    """The CMake project beside this file, built in the folder."""
    setting = [f"-DCMAKE_C_COMPILER={tools.first_installed(compiler)}", f"-DCMAKE_C_FLAGS={flags}", *settings]
    plain = ["-DCMAKE_BUILD_TYPE=", "-DCMAKE_COMPILE_WARNING_AS_ERROR=ON"]
    tools.assert_silent(["cmake", "-S", Path(__file__).with_name(source), "-B", folder, *setting, *plain])
    tools.assert_silent(["cmake", "--build", folder, "--parallel", "2"])


def output(compiler: str, flags: str, folder: Path) -> list[str]:
    """What the program of embedded/ prints."""
    is_cross = compiler == BIG_ENDIAN[0]
    build("embedded", compiler, flags, folder, *(CROSS if is_cross else []))
    result = tools.run([*(BIG_ENDIAN[1:] if is_cross else []), folder / "embedded", str(SAMPLES)])
    assert result.returncode == 0, result.stdout
    return result.stdout.splitlines()


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return output("cc|gcc|clang", "-O1", tmp_path_factory.mktemp("reference"))


def test_the_program_exercises_the_filter(reference: list[str]) -> None:
    """Otherwise equal output would prove little: every run must leave its first guess, with finite numbers, and every
    message of the estimator is sent."""
    *printed, verdict = (line.split() for line in reference)
    assert verdict == ["self", "test", "passed"]
    bus = [line for line in printed if line[0] == "bus"]
    sent = {int(frame.partition("#")[0], 16) for line in bus for frame in line[3:]}
    dbc = (tools.FIRMWARE / "can/lever.dbc").read_text(encoding="utf-8")
    assert sent == {identifier for each in re.findall(r"^BO_ (\d+) ", dbc, re.M) if (identifier := int(each)) >= 0x200}
    estimates = [line for line in printed if line[0] != "bus"]
    runs = {line[0] for line in estimates}
    assert len(estimates) == SAMPLES * len(runs)
    for run in runs:
        lines = [line for line in estimates if line[0] == run]
        assert lines[-1][2] == "2", "not in mode run"
        for first, last in zip(lines[0][7:13:2], lines[-1][7:13:2], strict=True):
            start, end = (struct.unpack(">f", bytes.fromhex(bits))[0] for bits in (first, last))
            assert start != 0.0
            assert 0.001 < abs(end / start - 1.0) < 10.0


@pytest.mark.parametrize(("compiler", "flags"), BUILDS)
def test_same_bits(reference: list[str], compiler: str, flags: str, tmp_path: Path) -> None:
    lines = output(compiler, flags, tmp_path)
    assert len(lines) == len(reference)
    differing = [pair for pair in zip(reference, lines, strict=True) if pair[0] != pair[1]]
    assert not differing, "first difference:\n" + "\n".join(differing[0])


@pytest.mark.requires(*BIG_ENDIAN)
def test_the_unit_tests_of_the_core_pass_on_a_big_endian_machine(build_dir: Path, tmp_path: Path) -> None:
    unity = build_dir / "unity"
    if not unity.is_dir():  # the build uses one that is installed, for the host only
        unity = tmp_path / "unity"
        tools.assert_silent([sys.executable, tools.ROOT / "tests/setup/fetch_unity.py", unity])
    emulator = f"-DCMAKE_CROSSCOMPILING_EMULATOR={tools.first_installed(BIG_ENDIAN[1])}"
    build("big_endian", BIG_ENDIAN[0], "-O2", tmp_path / "build", *CROSS, emulator, f"-DUNITY={unity}")
    tools.assert_silent(["ctest", "--test-dir", tmp_path / "build", "--parallel", "2", "--output-on-failure"])


@pytest.mark.requires("valgrind")
def test_no_uninitialised_memory_is_read(tmp_path: Path) -> None:
    build("embedded", "cc|gcc|clang", "-O1 -g", tmp_path)
    valgrind = ["valgrind", "--quiet", "--error-exitcode=1", "--track-origins=yes"]
    tools.assert_silent([*valgrind, tmp_path / "embedded", "300"])
