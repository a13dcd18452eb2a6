"""A command whose files do not all fit leaves what was in its folder, none of the new ones, and one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from lever_sil.study.figures import runs
from processes import full_disk
from python.conftest import Run
from python.study.shown import SHORT

COMPARE = ["compare", "--scenarios", "step_up", "--estimators", "joint_ekf", "--seeds", "1", "--duration", "2"]


@pytest.mark.parametrize(
    ("command", "size", "fits"),
    [
        (["sim", "steady", "--set", "duration=2 s", "--set", "limits={}", "--out"], 1_000_000, "bus.log"),
        (["figures", "--only", "excitation", "--out"], 1_000_000, "excitation.png"),
        ([*COMPARE, "--out"], 1_000_000, "compare.csv"),
        (["dbc", "--wireshark"], 1_000, "Signal_PDU_identifiers"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_all_files_or_none(
    command: list[str], size: int, fits: str, tmp_path: Path, lever: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`fits` would go in."""
    monkeypatch.setattr(runs, "Extent", lambda: SHORT)
    (tmp_path / fits).write_text("of an earlier run")
    with full_disk(size):
        status, _, error = lever(*command, tmp_path)
    assert (status, error.count("\n")) == (2, 1)
    assert error.startswith(f"lever: error: cannot write {tmp_path}/")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(fits, "of an earlier run")]
    assert lever(*command, tmp_path)[0] == 0
    assert 10 < (tmp_path / fits).stat().st_size <= size
    assert max(path.stat().st_size for path in tmp_path.iterdir()) > size
    assert not any(path.name.startswith(".") for path in tmp_path.iterdir())
