"""Without what asammdf says on standard error of a file that it cannot open: the reason is in the exception."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def quiet_asammdf() -> Iterator[None]:
    """Open in it, and after a failure, when its exception is gone, gc.collect() in it, which deletes its objects."""
    logger = logging.getLogger("asammdf")
    before = sys.unraisablehook, logger.disabled
    sys.unraisablehook, logger.disabled = lambda _: None, True
    try:
        yield
    finally:
        sys.unraisablehook, logger.disabled = before
