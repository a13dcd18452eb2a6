"""A replay whose files cannot be written, or that is interrupted, leaves what was there before, and nothing else."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from lever_cdkf.replay.outputs import FILES
from processes import LEVER, PATIENCE, full_disk
from python.conftest import Refused, Session


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of the file that cannot be closed
@pytest.mark.parametrize("size", [10_000, 500_000, 1_000_000, 2_000_000], ids=lambda size: f"{size} bytes")
def test_a_full_disk_is_one_line_and_no_file(size: int, session: Session, tmp_path: Path, refused: Refused) -> None:
    for name in FILES:
        (tmp_path / name).write_text("of an earlier run")
    with full_disk(size):
        line = refused("replay", session.log, "-o", tmp_path)
    assert line.startswith(f"lever: error: cannot write {tmp_path}")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(FILES, "of an earlier run")


def test_ctrl_c_leaves_nothing(session: Session, tmp_path: Path) -> None:
    pipe, out = tmp_path / "endless", tmp_path / "out"
    os.mkfifo(pipe)
    command = [LEVER, "replay", str(pipe), "-o", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process, pipe.open("wb") as file:
        file.write(session.log.read_bytes())
        file.flush()
        end = time.monotonic() + PATIENCE
        while not list(out.glob(".lever.*/bus.log")):
            assert time.monotonic() < end
            time.sleep(0.02)
        assert not any((out / name).exists() for name in FILES)
        process.send_signal(signal.SIGINT)
        assert process.stderr is not None
        assert process.stderr.read().decode() == "lever: interrupted\n"
        assert process.wait(PATIENCE) == 130
    assert not out.exists()


def test_a_folder_that_cannot_be_made_is_one_line(session: Session, tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "file").touch()
    assert "cannot make the folder" in refused("replay", session.log, "-o", tmp_path / "file/out")


@pytest.mark.parametrize(
    "arguments",
    [
        ["replay", "d/bus.log", "-o", "d"],
        ["replay", "link.log", "-o", "d"],
        ["replay", "d/bus.log", "--json", "d/bus.log"],
        ["tune", "d/bus.log", "-o", "d/bus.log"],
        ["tune", "d/bus.log", "--page", "link.log"],
    ],
    ids=" ".join,
)
def test_a_log_is_not_written_over_by_what_is_made_of_it(
    arguments: list[str],
    session: Session,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    refused: Refused,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("d").mkdir()
    Path("d/bus.log").write_bytes(session.log.read_bytes())
    Path("link.log").symlink_to("d/bus.log")
    assert refused(*arguments).endswith(": it is an input: choose another folder or name\n")
    assert os.listdir("d") == ["bus.log"]
    assert Path("d/bus.log").read_bytes() == session.log.read_bytes()
