"""The core computes the same bits whatever compiles and runs it, and reads no memory that it has not written.

The program of embedded/ is linked with the library of the build, and built with gcc and clang without optimisation,
with all there is for the very processor that runs this (which may have fused multiply-adds to be tempted by), and for a
big-endian MIPS; warnings are errors. All must print the same estimates and frames.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest
from quality import tools

SAMPLES = 3000
QUIET = "-Wno-unknown-warning-option -Wno-invalid-feature-combination"
"""Clang knows better than the newest processors what they have, and says so; gcc knows neither warning."""
BIG_ENDIAN = ("mips-linux-gnu-gcc", "qemu-mips-static")
PROGRAM = [
    Path(__file__).with_name("embedded") / "main.c",
    *(tools.FIRMWARE / "port/embedded" / name for name in ("self_test.c", "crc32.c")),
]
BUILDS = [
    pytest.param(compiler, flags, id=f"{compiler.split('|')[0]} {flags}", marks=pytest.mark.requires(compiler))
    for compiler in ("gcc", "clang-19|clang")
    for flags in ("-O0", f"-O3 -march=native {QUIET}")
] + [pytest.param(BIG_ENDIAN[0], "-O3 -static", id="mips -O3", marks=pytest.mark.requires(*BIG_ENDIAN))]


def build(compiler: str, flags: str, core: list[Path], folder: Path, build_dir: Path) -> Path:
    """The program of embedded/ with the core, its sources or a library, with the flags of the build and others."""
    command = [tools.first_installed(compiler), *tools.core_flags(build_dir), *flags.split()]
    tools.assert_silent([*command, *PROGRAM, *core, "-lm", "-o", folder / "embedded"])
    return folder / "embedded"


def output(*command: str | Path) -> list[str]:
    """What it prints."""
    result = tools.run([*command, str(SAMPLES)])
    assert result.returncode == 0, result.stdout
    return result.stdout.splitlines()


@pytest.fixture(scope="module")
def as_shipped(tmp_path_factory: pytest.TempPathFactory, build_dir: Path) -> Path:
    """The program with the library of the build."""
    library = build_dir / "firmware/liblever_cdkf.a"
    return build("cc|gcc|clang", "-O1", [library], tmp_path_factory.mktemp("as_shipped"), build_dir)


@pytest.fixture(scope="module")
def reference(as_shipped: Path) -> list[str]:
    return output(as_shipped)


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
@pytest.mark.requirement("R11")
def test_same_bits(reference: list[str], compiler: str, flags: str, tmp_path: Path, build_dir: Path) -> None:
    program = build(compiler, flags, tools.core_sources(), tmp_path, build_dir)
    lines = output(*(BIG_ENDIAN[1:] if compiler == BIG_ENDIAN[0] else ()), program)
    assert len(lines) == len(reference)
    differing = [pair for pair in zip(reference, lines, strict=True) if pair[0] != pair[1]]
    assert not differing, "first difference:\n" + "\n".join(differing[0])


@pytest.mark.requires("valgrind")
def test_no_uninitialised_memory_is_read(as_shipped: Path) -> None:
    tools.assert_silent(["valgrind", "--quiet", "--error-exitcode=1", as_shipped, "300"])
