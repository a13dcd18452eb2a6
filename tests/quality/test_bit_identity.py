"""The core computes the same bits whatever compiles and runs it, and reads no memory that it has not written.

The program of embedded/ is linked with the library of the build, and built with gcc and clang without optimisation,
with all there is for the very processor that runs this (which may have fused multiply-adds to be tempted by), and for a
big-endian MIPS; warnings are errors. All must print the same, and the digests in golden.txt.
"""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from quality import tools

EMBEDDED = Path(__file__).with_name("embedded")
QUIET = "-Wno-unknown-warning-option -Wno-invalid-feature-combination"
"""Clang knows better than the newest processors what they have, and says so; gcc knows neither warning."""
BIG_ENDIAN = ("mips-linux-gnu-gcc", "qemu-mips-static")
PROGRAM = [
    *sorted(EMBEDDED.glob("*.c")),
    *(tools.FIRMWARE / "port/embedded" / name for name in ("self_test.c", "crc32.c")),
]
BUILDS = [
    pytest.param(compiler, flags, id=f"{compiler.split('|')[0]} {flags}", marks=pytest.mark.requires(compiler))
    for compiler in ("gcc", "clang-19|clang")
    for flags in ("-O0", f"-O3 -march=native {QUIET}")
] + [pytest.param(BIG_ENDIAN[0], "-O3 -static", id="mips -O3", marks=pytest.mark.requires(*BIG_ENDIAN))]


def build(compiler: str, flags: str, core: list[Path], folder: Path, build_dir: Path) -> Path:
    """Return the program of embedded/ with the core, its sources or a library, with the flags of the build and
    others."""
    command = [tools.first_installed(compiler), *tools.core_flags(build_dir), *flags.split()]
    tools.assert_silent([*command, *PROGRAM, *core, "-lm", "-o", folder / "embedded"])
    return folder / "embedded"


def output(*command: str | Path) -> list[str]:
    """Return what it prints."""
    result = tools.run(command)
    assert result.returncode == 0, result.stdout
    return result.stdout.splitlines()


@pytest.fixture(scope="module")
def as_shipped(tmp_path_factory: pytest.TempPathFactory, build_dir: Path) -> Path:
    """Return the program with the library of the build."""
    library = build_dir / "firmware/liblever_cdkf.a"
    return build("cc|gcc|clang", "-O1", [library], tmp_path_factory.mktemp("as_shipped"), build_dir)


@pytest.fixture(scope="module")
def reference(as_shipped: Path) -> list[str]:
    return output(as_shipped)


def test_the_program_exercises_the_filter(reference: list[str]) -> None:
    """Otherwise equal output would prove little: with every model, estimator, preload and adaptation it leaves its
    first guess, with finite numbers."""
    rows = [line.split() for line in reference if line.startswith("choice.") and len(line.split()) > 2]
    last = {row[0]: row for row in rows}
    assert len(last) == 64
    for row in rows:
        for first, end in zip(row[3:9:2], last[row[0]][3:9:2], strict=True) if row[1] == "0" else ():
            start, now = (struct.unpack(">f", bytes.fromhex(bits))[0] for bits in (first, end))
            assert 1e-5 < abs(now / start - 1.0) < 10.0
    assert {row[2] for row in last.values()} == {"2"}, "not in mode run"


def test_flights_are_those_accepted(as_shipped: Path) -> None:
    """A change of behaviour is made on purpose: `cmake --build build --target golden-accept` accepts it."""
    result = tools.run([as_shipped, EMBEDDED / "golden.txt"])
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(("compiler", "flags"), BUILDS)
@pytest.mark.requirement("R11")
def test_same_bits(reference: list[str], compiler: str, flags: str, tmp_path: Path, build_dir: Path) -> None:
    program = build(compiler, flags, tools.core_sources(), tmp_path, build_dir)
    lines = output(*(BIG_ENDIAN[1:] if compiler == BIG_ENDIAN[0] else ()), program)
    assert len(lines) == len(reference)
    differing = [pair for pair in zip(reference, lines, strict=True) if pair[0] != pair[1]]
    assert not differing, "first difference:\n" + "\n".join(differing[0])


@pytest.mark.requires("clang-19|clang")
def test_no_uninitialised_memory_is_read(tmp_path: Path, build_dir: Path) -> None:
    flags = "-O1 -fsanitize=memory -fno-sanitize-recover=all"
    tools.assert_silent([build("clang-19|clang", flags, tools.core_sources(), tmp_path, build_dir), "digests"])
