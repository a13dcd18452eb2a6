"""A command whose files do not all fit leaves what was in its folder, none of the new ones, and one line."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from processes import LEVER, small_files

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
def test_all_files_or_none(command: list[str], size: int, fits: str, tmp_path: Path) -> None:
    """`fits` would go in."""
    (tmp_path / fits).write_text("of an earlier run")
    done = subprocess.run(
        [LEVER, *command, str(tmp_path)], preexec_fn=small_files(size), capture_output=True, text=True, check=False
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith(f"lever: error: cannot write {tmp_path}/")
    assert done.stderr.count("\n") == 1
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(fits, "of an earlier run")]
    whole = subprocess.run([LEVER, *command, str(tmp_path)], capture_output=True, text=True, check=False)
    assert whole.returncode == 0, whole.stderr
    assert 10 < (tmp_path / fits).stat().st_size <= size
    assert max(path.stat().st_size for path in tmp_path.iterdir()) > size
    assert not any(path.name.startswith(".") for path in tmp_path.iterdir())
