"""The command `lever` as a process of its own, for what only a process shows, and a disk that is full."""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LEVER = str(Path(sys.executable).with_name("lever"))


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file that this process writes may become larger than `size` bytes (Python ignores SIGXFSZ)."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
