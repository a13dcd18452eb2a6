"""The Python files are laid out by ruff, clean under its checks, and fully typed (settings: pyproject.toml)."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from quality import tools

RUFF = tools.python_tool("ruff")
FOLDERS = ("api", "firmware", "host_tools", "sil", "tests")


def test_layout() -> None:
    tools.assert_silent([RUFF, "format", "--check", "--diff", *FOLDERS])


def test_ruff() -> None:
    tools.assert_silent([RUFF, "check", *FOLDERS])


@pytest.fixture
def package_tree(build_dir: Path) -> Path:
    """The packages under the names by which they are imported, as the wheel has them (pyproject.toml)."""
    package = build_dir / "package_tree/lever_cdkf"
    package.mkdir(parents=True, exist_ok=True)
    for part in ("host_tools", "sil", "api/lever_cdkf/__init__.py"):
        link = package / Path(part).name
        link.unlink(missing_ok=True)
        link.symlink_to(tools.ROOT / part)
    return package.parent


@pytest.mark.skipif(sys.version_info < (3, 11), reason="the numpy for Python 3.10 declares other types")
def test_types(package_tree: Path, build_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MYPYPATH", f"{package_tree}:{tools.ROOT / 'tests'}")
    mypy = [tools.python_tool("mypy"), f"--config-file={tools.ROOT}/pyproject.toml", f"--cache-dir={build_dir}/mypy"]
    tools.assert_silent([*mypy, "--explicit-package-bases", package_tree, "firmware", "tests"])
