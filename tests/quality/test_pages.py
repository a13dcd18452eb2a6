"""The pages that are a path to follow (FLASH.md, SIL.md …) can be followed: their commands run one after the other.

All `sh` blocks of a page are one script, in a scratch folder that looks like the source tree, with the virtual
environment active; so a step finds what the steps before have left in out/. Of the lines that begin with cmake only
those that build in out/ are run: the others are what runs this.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import readmes
from quality import test_readme, tools

PAGES = {
    page: "\n".join(scripts)
    for folder in test_readme.FOLDERS
    for page in sorted((tools.ROOT / folder).rglob("*.md"))
    if page.name != "README.md" and (scripts := list(readmes.blocks(page, "sh").values()))
}
TIME_LIMIT = "280"
"""For a page [s]."""


def runs_here(line: str) -> bool:
    return not line.startswith(("ctest", "sudo")) and (not line.startswith("cmake") or "out/" in line)


def test_there_are_pages() -> None:
    assert {"FLASH.md", "SIL.md"} <= {page.name for page in PAGES}


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.name, marks=[mark for words, mark in test_readme.NEEDED.items() if words in script])
        for page, script in PAGES.items()
    ],
)
def test_page_can_be_followed(page: Path, tmp_path: Path, build_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for entry in tools.ROOT.iterdir():
        if entry.name != "build" and not entry.name.startswith("."):
            (tmp_path / entry.name).symlink_to(entry)
    (tmp_path / "build").symlink_to(build_dir)
    monkeypatch.setenv("PATH", f"{build_dir}/venv/bin:{os.environ['PATH']}")
    script = "\n".join(line for line in PAGES[page].splitlines() if runs_here(line))
    tools.assert_silent(["timeout", TIME_LIMIT, "bash", "-euo", "pipefail", "-c", script], cwd=tmp_path)
