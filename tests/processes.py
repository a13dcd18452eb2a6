"""The command `lever`: in this process, and as a process of its own for what only a process shows."""

from __future__ import annotations

import contextlib
import io
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from lever_cdkf.host_tools import cli

LEVER = str(Path(sys.executable).with_name("lever"))


def lever(*arguments: str | Path) -> str:
    """What the command prints when it is run in this process, where Python need not start first; it must do."""
    output, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        status = cli.main([str(argument) for argument in arguments])
    assert status == 0, errors.getvalue()
    return output.getvalue()


def small_files(size: int) -> Callable[[], None]:
    """For a process that may write no file larger than `size` bytes: like a full disk, wherever it writes."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit
