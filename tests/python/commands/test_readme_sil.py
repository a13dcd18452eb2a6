"""What sil/README.md and `lever sim --help` must not leave out; that their commands work is tested by tests/quality."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lever_cdkf.cli.main import main
from lever_sil.commands import sim
from lever_sil.plants import excitation, trajectories
from lever_sil.scenarios import scenario
from readmes import blocks


def test_every_kind_and_every_key_is_described(root: Path) -> None:
    text = (root / "sil/README.md").read_text(encoding="utf-8")
    for kind in (*trajectories.KINDS, *excitation.KINDS):
        assert f"`{kind}` (" in text, kind
    for key in scenario.Scenario.__dataclass_fields__.keys() - {"name", "file"}:
        assert re.search(rf"`\[*{key}\b", text), key


def test_the_examples_in_python_keep_the_limits(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both pages simulate the same."""
    first, second = (next(iter(blocks(root / f"sil/{page}.md", "python").values())) for page in ("README", "SIL"))
    pattern = r"= (scenario\.load\(.*\))"
    assert re.findall(pattern, first) == re.findall(pattern, second) != []
    exec(first, {})
    assert capsys.readouterr().out.startswith("All limits kept.")


def test_help_shows_a_line_for_each_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "--help"]) == 0
    shown = capsys.readouterr().out
    for file in (
        "bus.log",
        "trace.csv",
        "summary.json",
        "report.html",
        *re.findall(r"^  lever .*", sim._EPILOG, re.M),
    ):
        assert file in shown
