"""A campaign on Dask: chunks go to workers, a few at a time, and come back as counts.

The client keeps the numbers of the chunks that are done and a few futures, whatever the size of the campaign; rows
leave a worker as a file only. Once a second it looks at the connection itself, as Dask would wait for a scheduler that
was killed.
"""

from __future__ import annotations

import importlib.util
import logging
import queue
import socket
import time as clock
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lever_cdkf.errors import LeverError
from lever_cdkf.runtime import interrupts

from .chunks import Chunk, Plan, fingerprint, make

if TYPE_CHECKING:
    from distributed import Client, Future

Show = Callable[[int, int, str], None]
"""Progress: runs done, runs in all, the same in words with the time left."""

_AHEAD = 3  # chunks for each thread of the workers, so that none waits for the client
_MOST_LOST = 10  # chunks, after which something is wrong with all
_ALONE = ", alone"  # of a task's key
_CONNECT = 10.0  # [s]
_NO_WORKERS = 300.0  # [s] that killed workers are given to start again
_KEPT_MEMORY = str(1 << 28)
"""[bytes] up to which a worker's arrays come from memory that it has already. Dask has it given back after each of
them, and getting it again takes a quarter of a run's time."""
_ENVIRONMENT = {"MALLOC_TRIM_THRESHOLD_": _KEPT_MEMORY, "MALLOC_MMAP_THRESHOLD_": _KEPT_MEMORY}
_BEGIN = "from lever_cdkf.runtime import extras; extras.hide_mf4(())"
"""What a worker runs first: it reads no logs."""
_GONE = "the scheduler is gone; what is finished is kept: repeat the command with --resume when there is one again"


@dataclass
class Session:
    """What this call of the command has done."""

    runs: int = 0
    """Rows written."""
    seconds: float = 0.0
    """Processor time that workers took for them."""
    lost: list[Chunk] = field(default_factory=list)
    """Chunks that killed every worker that tried them, alone at last."""


def run(plan: Plan, folder: Path, client: Client, show: Show) -> Session:
    """Make the chunks whose files are not there yet. Raise LeverError."""
    done = plan.done(folder)
    todo = (plan.chunk(number) for number in range(plan.count) if number not in done)
    session, before = Session(), sum(plan.runs(plan.chunk(number)) for number in done)
    start, total = clock.monotonic(), plan.spec.runs

    def progress() -> None:
        kept = f"{before + session.runs} of {total} runs kept"
        if session.runs:
            seconds = (clock.monotonic() - start) * (total - before - session.runs) / session.runs
            kept += f", {_time(seconds)} left"
        show(before + session.runs, total, kept)

    for chunk, result in _results(client, plan, folder, todo, progress):
        if isinstance(result, Exception):
            session.lost.append(chunk)
            if len(session.lost) >= _MOST_LOST:
                break
            continue
        rows, seconds = result
        session.runs += rows
        session.seconds += seconds
        progress()
    return session


def _results(
    client: Client, plan: Plan, folder: Path, todo: Iterator[Chunk], tick: Callable[[], None]
) -> Iterator[tuple[Chunk, tuple[int, float] | Exception]]:
    """Yield the results of each chunk, when it is finished; raise LeverError.

    They are rows and processor time, or how it killed the workers.

    Dask blames what kills a worker on all chunks that this worker was given. So these are tried again one by one, and
    only what kills the workers then is given up.
    """
    from distributed import KilledWorker

    finished: queue.Queue[Future] = queue.Queue()
    running: dict[str, tuple[Chunk, Future]] = {}
    suspects: deque[Chunk] = deque()
    most = _AHEAD * max(1, sum(client.nthreads().values()))

    def submit(chunk: Chunk, key: str) -> None:
        future = client.submit(work, plan, chunk, folder, key=key, pure=True)
        running[key] = chunk, future
        future.add_done_callback(finished.put)

    def fill() -> None:
        """Give the workers what they can do side by side, or one suspect."""
        while len(running) < most and len(suspects) < _MOST_LOST and (chunk := next(todo, None)):
            submit(chunk, chunk.name(plan.fingerprint))
        if suspects and not running:
            chunk = suspects.popleft()
            submit(chunk, chunk.name(plan.fingerprint) + _ALONE)

    fill()
    seen = clock.monotonic()  # workers
    while running:
        future = _next(client, finished, tick)
        if future is None:
            seen = _seen(client, seen)
            continue
        seen = clock.monotonic()
        chunk, key = running.pop(future.key)[0], future.key
        try:
            error = future.exception()
            result = future.result() if error is None else error
        except (OSError, CancelledError):  # while it was fetched
            raise LeverError(_GONE) from None
        if error is not None and not isinstance(error, KilledWorker):
            raise LeverError(f"flights {chunk.first} to {chunk.end - 1}: {_line(error)}") from error
        del future
        if error is None or key.endswith(_ALONE):
            yield chunk, result
        else:
            suspects.append(chunk)
        fill()


def _next(client: Client, finished: queue.Queue[Future], tick: Callable[[], None]) -> Future | None:
    """Return the next future that is done; None when a second has passed without. Raise LeverError."""
    try:
        future = finished.get(timeout=1.0)
    except queue.Empty:
        future = None
    interrupts.check()
    if client.status != "running" or (future is not None and future.status in ("cancelled", "lost")):
        raise LeverError(_GONE)
    if future is None:
        tick()
    return future


def _seen(client: Client, before: float) -> float:
    """When there were workers last: now, or `before`. Raise LeverError when that is too long ago."""
    now = clock.monotonic()
    if client.nthreads():
        return now
    if now - before > _NO_WORKERS:
        raise LeverError("all workers are gone; what is finished is kept: go on with --resume")
    return before


def dashboard(client: Client) -> str:
    """Where a browser sees the workers: Dask's own pages, or its tables where bokeh is not installed."""
    page = str(client.dashboard_link)
    return page if importlib.util.find_spec("bokeh") else page.replace("/status", "/info/main/workers.html")


def work(plan: Plan, chunk: Chunk, folder: Path) -> tuple[int, float]:
    """On a worker: makes a chunk; return its rows and the processor time [s]."""
    here = socket.gethostname()
    if fingerprint(plan.spec) != plan.fingerprint:
        raise LeverError(f"the worker on {here} has another build of lever-cdkf: install the same everywhere")
    if not folder.is_dir():
        raise LeverError(f"the worker on {here} has no folder {folder}: it must be on a file system that all share")
    start = clock.thread_time()
    rows = make(plan, chunk, folder)
    return rows, clock.thread_time() - start


def _line(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, LeverError) else f"{type(error).__name__}: {text}"


def _time(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@contextmanager
def connected(address: str | None, workers: int) -> Iterator[Client]:
    """Yield a client of the scheduler at `address`, or of a cluster of so many processes on this machine.

    Raise LeverError when nobody is there.
    """
    import dask
    from distributed import Client, LocalCluster

    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] == "distributed":  # what it says of lost connections, the error says in a line
            logging.getLogger(name).setLevel(logging.CRITICAL)
    if address is not None:
        try:
            client = Client(address, timeout=_CONNECT)
        except (OSError, ValueError) as error:
            raise LeverError(f"no Dask scheduler at {address}: {_line(error)}") from None
        with client:
            if not client.nthreads():
                raise LeverError(f"the scheduler at {address} has no workers yet: start some (dask worker {address})")
            yield client
        return
    options: dict[str, Any] = {"dashboard_address": "127.0.0.1:0", "memory_limit": 0, "threads_per_worker": 1}
    settings = {
        "distributed.logging.distributed": "critical",
        "distributed.nanny.pre-spawn-environ": _ENVIRONMENT,
        "distributed.worker.preload": [_BEGIN],
        "distributed.deploy.lost-worker-timeout": f"{_NO_WORKERS:g} s",  # 15 s are too short for a busy machine
    }
    with dask.config.set(settings):
        with interrupts.masked():
            cluster = LocalCluster(n_workers=workers, silence_logs=logging.CRITICAL, **options)
        with cluster, Client(cluster) as client:
            yield client
