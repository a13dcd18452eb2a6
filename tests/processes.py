"""The command `lever`: in this process, and as a process of its own for what only a process shows; a full disk."""

from __future__ import annotations

import contextlib
import io
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

from lever_cdkf.cli.main import main

LEVER = str(Path(sys.executable).with_name("lever"))
PATIENCE = 120.0
"""[s] for what hangs; nothing is expected to be fast."""


def lever(*arguments: str | Path) -> str:
    """Return what the command prints when it is run in this process, where Python need not start first; it must do."""
    output, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        status = main([str(argument) for argument in arguments])
    assert status == 0, errors.getvalue()
    return output.getvalue()


@contextlib.contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file that this process writes may become larger than `size` bytes (Python ignores SIGXFSZ).

    Modules are imported without writing their bytecode: Python would keep a .pyc that is cut off, and fail to load it
    ever after.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    writes_no_bytecode = sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = writes_no_bytecode
