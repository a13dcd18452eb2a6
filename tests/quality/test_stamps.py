"""A proof runs when its inputs have changed since it passed, and only then."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from quality import tools

STAMPED = tools.ROOT / "tests/setup/stamped.py"
Prove = Callable[..., int]


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Return a source tree with a copy of the program, and an input a/x."""
    for name in ("tests/setup", "a/__pycache__", "build"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("CMakeLists.txt", "CMakePresets.json", "pyproject.toml", "tests/CMakeLists.txt", "tests/conftest.py"):
        (tmp_path / name).write_text("")
    (tmp_path / "build/CMakeCache.txt").write_text("CMAKE_BUILD_TYPE:STRING=Release\n")
    (tmp_path / "tests/setup/stamped.py").write_bytes(STAMPED.read_bytes())
    (tmp_path / "a/x").write_text("1")
    return tmp_path


@pytest.fixture
def prove(tree: Path) -> Prove:
    """prove(status, **variables): run the proof, which ends with that status; return how often it has run in all."""

    def run(status: int = 0, **variables: str) -> int:
        proof = f"printf . >> runs; exit {status}"
        stamped: list[str | Path] = [sys.executable, "-S", tree / "tests/setup/stamped.py", "p", "build", "a", "--"]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LEVER_")} | variables
        done = subprocess.run([*stamped, "sh", "-c", proof], cwd=tree, env=environment, check=False)
        assert done.returncode in (0, status)
        runs = tree / "runs"
        return len(runs.read_text()) if runs.exists() else 0

    return run


def test_a_proof_that_passed_is_not_repeated(prove: Prove, tree: Path) -> None:
    assert (prove(), prove()) == (1, 1)
    (tree / "a/__pycache__/x.pyc").write_text("compiled")
    assert prove(LEVER_REQUIRE_ALL="1") == 1


@pytest.mark.parametrize("status", [1, 77])
def test_a_proof_that_failed_or_was_skipped_is_repeated(prove: Prove, status: int) -> None:
    assert (prove(status), prove(status)) == (1, 2)


@pytest.mark.parametrize("changed", ["a/x", "a/new", "tests/setup/stamped.py", "build/CMakeCache.txt"])
def test_a_proof_is_repeated_after_a_change(prove: Prove, tree: Path, changed: str) -> None:
    prove()
    with (tree / changed).open("a") as file:
        file.write("CMAKE_C_FLAGS:STRING=-O2\n" if changed.startswith("build") else "# changed\n")
    assert (prove(), prove()) == (2, 2)


def test_an_input_that_has_gone_is_noticed(prove: Prove, tree: Path) -> None:
    (tree / "a/new").write_text("")
    assert prove() == 1
    (tree / "a/new").unlink()
    assert prove() == 2


def test_variables_change_what_is_proven(prove: Prove) -> None:
    assert (prove(), prove(LEVER_FUZZ_SECONDS="60"), prove(LEVER_STAMPS="")) == (1, 2, 3)


def test_stamps_in_a_folder_of_the_machine_serve_every_clone(prove: Prove, tree: Path) -> None:
    stamps = str(tree / "elsewhere")
    prove(LEVER_STAMPS=stamps)
    (tree / "build").rename(tree / "old")
    (tree / "build").mkdir()
    (tree / "build/CMakeCache.txt").write_text("CMAKE_BUILD_TYPE:STRING=Release\n")
    assert prove(LEVER_STAMPS=stamps) == 1
