"""C files are laid out as .clang-format says, the firmware is clean under .clang-tidy; and both checks bite."""

from __future__ import annotations

import json
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


def clang_tidy(database: Path, file: Path) -> list[str | Path]:
    return [tools.python_tool("clang-tidy"), "--quiet", f"--config-file={tools.ROOT}/.clang-tidy", "-p", database, file]


def test_layout() -> None:
    tools.assert_silent(clang_format(*tools.c_files()))


def test_layout_check_finds_a_seeded_violation(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(UNFORMATTED)
    assert tools.run(clang_format(seeded)).returncode != 0


def test_clang_tidy(build_dir: Path) -> None:
    database = json.loads((build_dir / "compile_commands.json").read_text())
    folders = {tools.FIRMWARE, tools.ROOT / "host_tools"}
    ours = sorted({file for entry in database if folders & set((file := Path(entry["file"])).parents)})
    assert set(tools.core_sources()) <= set(ours)
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda file: tools.run(clang_tidy(build_dir, file)), ours))
    failures = [result.stdout for result in results if result.returncode != 0]
    if failures:
        pytest.fail("\n".join(failures), pytrace=False)


def test_clang_tidy_finds_a_seeded_violation(tmp_path: Path) -> None:
    seeded = tmp_path / "seeded.c"
    seeded.write_text(UNTIDY)
    entry = {"directory": str(tmp_path), "file": str(seeded), "arguments": ["cc", "-std=c99", "-c", str(seeded)]}
    (tmp_path / "compile_commands.json").write_text(json.dumps([entry]))
    result = tools.run(clang_tidy(tmp_path, seeded))
    assert result.returncode != 0
    assert "cert-err34-c" in result.stdout
