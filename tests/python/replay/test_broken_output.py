"""A replay whose files cannot be written, or that is interrupted, leaves what was there before, and nothing else."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from lever_cdkf.host_tools import cli
from lever_cdkf.host_tools.replay.outputs import FILES
from python.conftest import Session

LEVER = str(Path(sys.executable).with_name("lever"))


def small_files(size: int) -> Callable[[], None]:
    """For a process that may write no file larger than `size` bytes: like a full disk, wherever it writes."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


@pytest.mark.parametrize("size", [10_000, 500_000, 1_000_000, 2_500_000], ids=lambda size: f"{size} bytes")
def test_a_full_disk_is_one_line_and_no_file(size: int, session: Session, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert cli.main(["replay", str(session.log), "-o", str(out)]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    command = [LEVER, "replay", str(session.log), "-o", str(out), "--set", "m_p=3"]
    done = subprocess.run(command, preexec_fn=small_files(size), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("lever: error: cannot write ")
    assert done.stderr.count("\n") == 1, done.stderr
    assert str(out) in done.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_ctrl_c_leaves_nothing(session: Session, tmp_path: Path) -> None:
    pipe, out = tmp_path / "endless", tmp_path / "out"
    os.mkfifo(pipe)
    command = [LEVER, "replay", str(pipe), "-o", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process, pipe.open("wb") as file:
        file.write(session.log.read_bytes())
        file.flush()
        end = time.monotonic() + 30.0
        while not list(out.glob(".replay.*/bus.log")):
            assert time.monotonic() < end
            time.sleep(0.02)
        assert not any((out / name).exists() for name in FILES)
        process.send_signal(signal.SIGINT)
        assert process.wait(30.0) == 130
    assert list(out.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_one_line(
    session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert cli.main(["replay", str(session.log), "-o", str(tmp_path / "file/out")]) == 2
    assert "cannot make the folder" in capsys.readouterr().err
