"""The command `lever` as a process of its own, for what only a process shows."""

from __future__ import annotations

import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path

LEVER = str(Path(sys.executable).with_name("lever"))


def small_files(size: int) -> Callable[[], None]:
    """For a process that may write no file larger than `size` bytes: like a full disk, wherever it writes."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit
