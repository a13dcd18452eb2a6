"""The progress of a command, shown on standard error once it takes longer than a moment."""

from __future__ import annotations

import sys
import time
from typing import Any

from ..runtime import interrupts

PATIENCE = 2.0
"""[s] before anything is said."""
_BETWEEN_LINES = 30.0  # [s] where standard error is not a terminal


class Progress:
    """A bar, or lines where standard error is not a terminal. A context manager, which takes the bar away again."""

    def __init__(self, command: str) -> None:
        self._command = command
        self._start = self._printed_at = time.monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, done: int, total: int, what: str = "") -> None:
        """So much of `total` is done; `what` says what the last of it was. Here a lost Ctrl-C is found."""
        interrupts.check()
        now = time.monotonic()
        if now - self._start < PATIENCE:
            return
        if sys.stderr.isatty():
            self._draw(done, total, what or self._command)
        elif now - self._printed_at >= _BETWEEN_LINES:
            self._printed_at = now
            last = f" ({what})" if what else ""
            print(f"lever: {self._command}: {done} of {total} after {now - self._start:.0f} s{last}", file=sys.stderr)

    def _draw(self, done: int, total: int, label: str) -> None:
        if self._bar is None:
            from rich.console import Console
            from rich.progress import Progress as Bar

            self._bar = Bar(console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task("", total=total)
        self._bar.update(self._task, completed=done, description=label)
