"""C files are laid out as .clang-format says, the firmware is clean under .clang-tidy; and both checks bite."""

from __future__ import annotations

import json
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from quality import tools

UNTIDY = (
    "#include <stdlib.h>\nint seeded(const char *text);\nint seeded(const char *text)\n{\n    return atoi(text);\n}\n"
)
UNFORMATTED = "int  seeded( void ) {return 1;}\n"


def clang_format(*files: Path) -> list[str | Path]:
    return [
        tools.python_tool("clang-format"),
        "--dry-run",
        "--Werror",
        f"--style=file:{tools.ROOT}/.clang-format",
        *files,
    ]


def clang_tidy(database: Path, file: Path, *options: str) -> list[str | Path]:
    configuration = f"--config-file={tools.ROOT}/.clang-tidy"
    return [tools.python_tool("clang-tidy"), "--quiet", configuration, "-p", database, *options, file]


def assert_tidy(database: Path, files: Iterable[Path], *options: str) -> None:
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda file: tools.run(clang_tidy(database, file, *options)), files))
    failures = [result.stdout for result in results if result.returncode != 0]
    if failures:
        pytest.fail("\n".join(failures), pytrace=False)


def compiled(database: Path, folder: Path) -> list[Path]:
    """The C files under a folder that a build has compiled."""
    entries = json.loads((database / "compile_commands.json").read_text())
    return sorted({file for entry in entries if folder in (file := Path(entry["file"])).parents})


def test_layout() -> None:
    tools.assert_silent(clang_format(*tools.c_files()))


def test_layout_check_finds_a_seeded_violation(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(UNFORMATTED)
    assert tools.run(clang_format(seeded)).returncode != 0


def test_clang_tidy(build_dir: Path) -> None:
    ours = compiled(build_dir, tools.FIRMWARE) + compiled(build_dir, tools.ROOT / "host_tools")
    assert set(tools.core_sources()) <= set(ours)
    assert_tidy(build_dir, ours)


@pytest.mark.requires("arm-none-eabi-gcc")
def test_clang_tidy_of_the_image(build_dir: Path) -> None:
    """clang speaks for the same processor, and reads the C library of the cross compiler."""
    port = tools.FIRMWARE / "port/stm32f4"
    ours = compiled(build_dir / "stm32f4", port)
    assert ours == sorted(port.glob("*.c"))
    sysroot = tools.run(["arm-none-eabi-gcc", "-print-sysroot"]).stdout.strip()
    headers = (f"{sysroot}/include/newlib", f"{sysroot}/include", "/usr/include/newlib")
    options = ("--target=thumbv7em-none-eabihf", *(f"-isystem{folder}" for folder in headers))
    assert_tidy(build_dir / "stm32f4", ours, *(f"--extra-arg={option}" for option in options))


def test_clang_tidy_finds_a_seeded_violation(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(UNTIDY)
    entry = {"directory": str(tmp_path), "file": str(seeded), "arguments": ["cc", "-std=c99", "-c", str(seeded)]}
    (tmp_path / "compile_commands.json").write_text(json.dumps([entry]))
    result = tools.run(clang_tidy(tmp_path, seeded))
    assert result.returncode != 0
    assert "cert-err34-c" in result.stdout
