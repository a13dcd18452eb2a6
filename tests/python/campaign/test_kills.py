"""A campaign whose worker, scheduler or client is killed loses nothing, repeats nothing, and writes the same bytes."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from python.campaign.conftest import files
from python.conftest import Run

pytestmark = pytest.mark.usefixtures("installed")

INTERRUPTED = "lever: interrupted: {} of 48 runs kept; go on with --resume\n"
PATIENCE = 120.0  # [s] until something is given up that takes a second on an idle machine


def until(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait for it, while the process lives."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)


def begin(*arguments: str | Path, start_new_session: bool = False) -> subprocess.Popen[str]:
    """`lever campaign`, started."""
    command = [sys.executable, "-m", "lever_cdkf.cli.main", "campaign", *map(str, arguments)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=start_new_session)


def workers(client: int) -> list[int]:
    """Return the worker processes that a client has started."""
    children = Path(f"/proc/{client}/task/{client}/children").read_text().split()
    tasks = [path.read_text().split() for path in Path(f"/proc/{client}/task").glob("*/children")]
    found = {int(child) for each in (*tasks, children) for child in each}
    return sorted(pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes())


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Yield the address of a Dask scheduler and the process of its worker, started as on a command line."""
    dask = [sys.executable, "-m", "dask"]
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    place: dict[str, Any] = {"cwd": folder.parent, "text": True, "stderr": subprocess.PIPE}
    scheduler = subprocess.Popen([*dask, "scheduler", *options], **place)
    worker = None
    try:
        assert scheduler.stderr is not None
        line = next(line for line in scheduler.stderr if "Scheduler at:" in line)
        address = re.findall(r"tcp://\S+", line)[0]
        threads = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(folder.parent)]
        worker = subprocess.Popen([*dask, "worker", address, *threads], **place)
        assert worker.stderr is not None
        assert any("Registered to" in line for line in worker.stderr)
        yield address, scheduler
    finally:
        for process in (scheduler, worker):
            if process is not None:
                process.terminate()
                process.communicate()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks for processes in /proc")
class TestKilled:
    def test_the_client_and_then_a_worker(
        self, small_file: Path, undisturbed: dict[str, bytes], tmp_path: Path, lever: Run
    ) -> None:
        """The campaign is resumed by another client, whose worker is replaced."""
        client = begin(small_file, "-o", tmp_path, "--workers", "1")
        until(lambda: len(files(tmp_path)) >= 2, client)
        children = workers(client.pid)
        client.kill()
        client.communicate()
        end = time.monotonic() + PATIENCE
        while any(map(is_alive, children)):
            assert time.monotonic() < end
            time.sleep(0.01)
        kept = files(tmp_path)
        assert kept.items() <= undisturbed.items()
        assert 2 <= len(kept) < len(undisturbed)
        assert "add --resume" in lever("campaign", small_file, "-o", tmp_path)[2]
        written = {name: (tmp_path / name).stat().st_mtime_ns for name in kept}
        another = begin(small_file, "-o", tmp_path, "--workers", "1", "--resume")
        until(lambda: len(files(tmp_path)) >= len(kept) + 2, another)
        os.kill(workers(another.pid)[0], signal.SIGKILL)
        out, err = another.communicate(timeout=PATIENCE)
        assert another.returncode == 0, err
        assert "48 runs, 0 failed" in out
        assert files(tmp_path) == undisturbed
        assert {name: (tmp_path / name).stat().st_mtime_ns for name in kept} == written
        assert list(tmp_path.glob(".*")) == []

    def test_ctrl_c_of_a_terminal(self, small_file: Path, undisturbed: dict[str, bytes], tmp_path: Path) -> None:
        client = begin(small_file, "-o", tmp_path, "--workers", "1", start_new_session=True)
        until(lambda: len(files(tmp_path)) >= 2, client)
        os.killpg(client.pid, signal.SIGINT)
        _, err = client.communicate(timeout=PATIENCE)
        kept = files(tmp_path)
        assert (client.returncode, err) == (130, INTERRUPTED.format(2 * len(kept)))
        assert kept.items() <= undisturbed.items()
        assert len(kept) < len(undisturbed)

    def test_the_scheduler(self, small_file: Path, undisturbed: dict[str, bytes], tmp_path: Path) -> None:
        with cluster(tmp_path) as (address, scheduler):
            client = begin(small_file, "-o", tmp_path, "--scheduler", address)
            until(lambda: len(files(tmp_path)) >= 2, client)
            scheduler.kill()
            assert "repeat the command with --resume" in client.communicate(timeout=PATIENCE)[1]
            assert client.returncode == 2
        assert files(tmp_path).items() <= undisturbed.items()
