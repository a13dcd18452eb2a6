"""The examples of sil/README.md and of `lever sim --help`, as they stand there."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import readmes
from lever_cdkf.host_tools import cli
from lever_cdkf.sil.commands import sim
from lever_cdkf.sil.plants import excitation, trajectories
from lever_cdkf.sil.scenarios import scenario


def blocks(root: Path, language: str) -> list[str]:
    return list(readmes.blocks(root / "sil/README.md", language).values())


def test_shell(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lines = "".join(blocks(root, "sh")).splitlines()
    assert len(lines) == 9
    for line in lines:
        assert cli.main(shlex.split(line)[1:]) == 0, line
    assert (tmp_path / "out/steady/report.html").is_file()
    assert (tmp_path / "out/demo/summary.json").is_file()
    assert (tmp_path / "out/compare/compare.html").is_file()
    assert (tmp_path / "out/figures/grip.png").is_file()


def test_python(root: Path) -> None:
    (code,) = blocks(root, "python")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^\d+\.\d+ N/m$", done.stdout, re.MULTILINE)


def test_every_kind_and_every_key_is_described(root: Path) -> None:
    text = (root / "sil/README.md").read_text(encoding="utf-8")
    for kind in (*trajectories.KINDS, *excitation.KINDS):
        assert f"`{kind}` (" in text, kind
    for key in scenario.Scenario.__dataclass_fields__.keys() - {"name", "file"}:
        assert re.search(rf"`\[*{key}\b", text), key


def test_help_shows_a_line_for_each_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["sim", "--help"]) == 0
    shown = capsys.readouterr().out
    for file in (
        "bus.log",
        "trace.csv",
        "summary.json",
        "report.html",
        *re.findall(r"^  lever .*", sim._EPILOG, re.M),
    ):
        assert file in shown
