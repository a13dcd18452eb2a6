"""Ctrl-C or SIGTERM ends a command with one line and exit status 130, whenever it comes.

KeyboardInterrupt alone does not do that: it is lost when it is raised while an object is deleted, or in a library that
catches everything. So it is remembered as well, and looked for now and then, and before files are put into place.
"""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from .exit_status import exit_at_once
from .extras import hide_mf4, mf4_is_hidden

if TYPE_CHECKING:
    from multiprocessing.pool import Pool

_Task = TypeVar("_Task")
_Done = TypeVar("_Done")

START = 0.5
"""What worker processes take to start [s]."""
_USUAL = {signal.SIGINT: (signal.default_int_handler, exit_at_once), signal.SIGTERM: (signal.SIG_DFL,)}
"""Handlers where nobody else has taken the signal."""
_came = False


@contextmanager
def heard() -> Iterator[None]:
    """Inside, Ctrl-C and SIGTERM are a KeyboardInterrupt that check() knows of.

    Not one that is ignored or somebody else's.
    """
    before = {number: handler for number, usual in _USUAL.items() if (handler := signal.getsignal(number)) in usual}
    if not before or threading.current_thread() is not threading.main_thread():
        yield
        return
    hook = sys.unraisablehook
    for number in before:
        signal.signal(number, _hear)
    sys.unraisablehook = lambda lost: None if lost.exc_type is KeyboardInterrupt else hook(lost)
    try:
        yield
        check()
    except Exception:
        check()  # what fails after a lost one fails because of it
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = hook
        forget()


def _hear(_number: int, _frame: object) -> None:
    global _came
    _came = True
    raise KeyboardInterrupt


def check() -> None:
    """Raise the KeyboardInterrupt that has come, if it was lost."""
    if _came:
        raise KeyboardInterrupt


def forget() -> None:
    """Forget the signal, which has done what it should."""
    global _came
    _came = False


def in_processes(function: Callable[[_Task], _Done], tasks: Sequence[_Task], jobs: int) -> Iterator[_Done]:
    """Yield function(task) of all tasks, in their order, from `jobs` processes.

    What is done before they would have started is done in this one. Interrupted, it leaves no process behind.
    """
    done, end = 0, time.monotonic() + START
    while done < len(tasks) and (jobs == 1 or done == len(tasks) - 1 or time.monotonic() < end):
        yield function(tasks[done])
        done += 1
    if done < len(tasks):
        with worker_pool(min(jobs, len(tasks) - done)) as pool:
            yield from pool.imap(function, tasks[done:])


def worker_pool(processes: int) -> Pool:
    """Return processes that from their first moment leave Ctrl-C to this one, and hide what packages this one hides."""
    import multiprocessing

    context = multiprocessing.get_context("spawn")
    with masked():
        return context.Pool(processes, _begin, (mf4_is_hidden(),))


def _begin(without_mf4: bool) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if without_mf4:
        hide_mf4(())


@contextmanager
def masked() -> Iterator[None]:
    """Let processes that this thread, or a new one, starts inside leave Ctrl-C to this one. Not on Windows."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # else the first process starts it, which lets the signal through again
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # is passed on to threads and processes
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
