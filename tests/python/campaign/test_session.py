"""A session with Dask, against a client that fails as Dask's does."""

from __future__ import annotations

import logging
import queue
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import dask
import pytest
from distributed import KilledWorker
from lever_cdkf.cli.main import main
from lever_cdkf.errors import LeverError
from lever_sil.campaign import chunks, session, spec
from lever_sil.campaign.chunks import Chunk, Plan
from lever_sil.commands import campaign
from python.campaign.conftest import SMALL


class Future:
    """Of a chunk that is done at once, or has killed the workers."""

    status = "finished"

    def __init__(self, key: str) -> None:
        self.key = key
        self.error: KilledWorker | None = None
        self.rows = 0

    def add_done_callback(self, call: Callable[[Future], None]) -> None:
        self.call = call

    def exception(self) -> KilledWorker | None:
        return self.error

    def result(self) -> tuple[int, float]:
        return self.rows, 1.0


class Client:
    """Of two workers. What kills one is blamed on all that was given to the workers, as Dask does."""

    status = "running"

    def __init__(self, plan: Plan, killers: set[int]) -> None:
        self.plan, self.killers = plan, killers
        self.given: list[tuple[Future, Chunk]] = []
        self.together: list[int] = []

    def nthreads(self) -> dict[str, int]:
        return {"a": 1, "b": 1}

    def submit(self, _work: Any, _plan: Plan, chunk: Chunk, _folder: Path, *, key: str, pure: bool) -> Future:
        assert pure
        future = Future(key)
        self.given.append((future, chunk))
        return future

    def work(self) -> bool:
        """Do all that was given; whether that was anything."""
        given, self.given = self.given, []
        self.together.append(len(given))
        kills = any(chunk.first in self.killers for _, chunk in given)
        for future, chunk in given:
            if kills:
                future.error = KilledWorker(future.key, None, 3)
            future.rows = self.plan.runs(chunk)
            future.call(future)
        return bool(given)


def run(
    plan: Plan, killers: set[int], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[session.Session, Client, list[tuple[int, int, str]]]:
    """Return the session, its client, and the progress that was shown."""
    client = Client(plan, killers)
    shown: list[tuple[int, int, str]] = []

    def following(_client: Client, finished: queue.Queue[Future], tick: Callable[[], None]) -> Future:
        if finished.empty():
            tick()
            assert client.work()
        return finished.get_nowait()

    monkeypatch.setattr(session, "_next", following)
    done = session.run(plan, folder, client, lambda *progress: shown.append(progress))
    return done, client, shown


def test_only_the_chunk_that_kills_is_given_up(small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever else the workers had to do meanwhile is tried again, one by one."""
    done, client, _ = run(small, {7}, tmp_path, monkeypatch)
    assert [chunk.first for chunk in done.lost] == [7]
    assert done.runs == small.spec.runs - small.runs(done.lost[0])
    assert client.together.count(1) >= 6
    assert run(small, set(), tmp_path, monkeypatch)[0].lost == []


def test_when_all_kill_it_ends_early(small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = run(small, set(range(24)), tmp_path, monkeypatch)[0]
    assert len(done.lost) == 10
    assert done.runs == 0


def test_the_time_left_is_told_between_chunks_too(small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = run(small, set(), tmp_path, monkeypatch)[2]
    assert shown[0] == (0, small.spec.runs, f"0 of {small.spec.runs} runs kept")
    assert all(left.endswith("left") for _, _, left in shown[1:])
    assert shown[-1][:2] == (small.spec.runs, small.spec.runs)


def test_flights_that_killed_their_workers_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = tmp_path / "of_three.toml", tmp_path / "out"
    file.write_text(SMALL.replace("chunk = 1", "chunk = 3"))
    folder.mkdir()
    plan = Plan(spec.load(str(file)))
    lost = [plan.chunk(1), plan.chunk(7)]
    for number in {*range(plan.count)} - {1, 7}:
        chunks.make(plan, plan.chunk(number), folder)
    made = session.Session(runs=36, seconds=1.0, lost=lost)
    monkeypatch.setattr(campaign, "_run", lambda *_arguments: made)
    assert main(["campaign", str(file), "-o", str(folder)]) == 1
    assert "12 runs missing: flights 3 to 5, 21 to 23 killed their workers" in capsys.readouterr().err


class Done(Client):
    """Every chunk is done as soon as it is given, in some way."""

    def __init__(self, plan: Plan, error: Exception | None = None, status: str = "finished") -> None:
        super().__init__(plan, set())
        self.error, self.of_futures = error, status

    def submit(self, *arguments: Any, key: str, pure: bool) -> Future:
        future = super().submit(*arguments, key=key, pure=pure)
        chunk = self.given[-1][1]
        future.error, future.rows, future.status = self.error, self.plan.runs(chunk), self.of_futures
        self.given.clear()
        add = future.add_done_callback

        def at_once(call: Callable[[Future], None]) -> None:
            add(call)
            call(future)

        future.add_done_callback = at_once  # type: ignore[method-assign]
        return future


def begun(client: Any, plan: Plan, folder: Path) -> session.Session:
    return session.run(plan, folder, client, lambda *_: None)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (LeverError("the worker on a has another build"), "flights 0 to 0: the worker on a has another build"),
        (MemoryError("no\n  memory"), "flights 0 to 0: MemoryError: no memory"),
    ],
)
def test_what_fails_on_a_worker_is_said_in_a_line(error: Exception, said: str, small: Plan, tmp_path: Path) -> None:
    """An error of ours as it is, another with its kind."""
    with pytest.raises(LeverError) as refused:
        begun(Done(small, error), small, tmp_path)
    assert str(refused.value) == said


def test_a_session_counts_rows_and_processor_time(small: Plan, tmp_path: Path) -> None:
    chunks.make(small, small.chunk(3), tmp_path)
    done = begun(Done(small), small, tmp_path)
    assert (done.runs, done.seconds, done.lost) == (46, 23.0, [])


@pytest.mark.parametrize("status", ["cancelled", "lost"])
def test_a_scheduler_that_is_gone_is_said_with_what_to_do(status: str, small: Plan, tmp_path: Path) -> None:
    clients: list[Any] = [Done(small, status=status), Done(small)]
    clients[1].status = "closed"
    for client in clients:
        with pytest.raises(LeverError, match=r"the scheduler is gone; .* repeat the command with --resume"):
            begun(client, small, tmp_path)


def test_workers_that_are_gone_for_five_minutes_end_it(
    small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not while there are some, nor before."""

    class Idle(Client):
        def nthreads(self) -> dict[str, int]:
            return {"a": 1} if now[0] < 1000.0 else {}

    now = [0.0]

    def following(*_: Any) -> None:
        now[0] += 100.0

    monkeypatch.setattr(session, "_next", following)
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    with pytest.raises(LeverError, match="all workers are gone; what is finished is kept: go on with --resume"):
        begun(Idle(small, set()), small, tmp_path)
    assert now[0] == 1300.0, "seen last at 900 s"


@pytest.mark.parametrize(
    ("seconds", "left"), [(1.0, "23 s"), (3.87, "89 s"), (3.92, "2 min"), (230.0, "88 min"), (236.0, "1.5 h")]
)
def test_the_time_left_is_in_words(
    seconds: float, left: str, small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After the first chunk of 24: 23 times what that took."""
    now, shown = [0.0], []

    def following(_client: Any, finished: queue.Queue[Future], _tick: Any) -> Future:
        now[0] = seconds
        return finished.get_nowait()

    monkeypatch.setattr(session, "_next", following)
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    client: Any = Done(small)
    session.run(small, tmp_path, client, lambda *progress: shown.append(progress))
    assert shown[0] == (2, 48, f"2 of 48 runs kept, {left} left")


def test_a_worker_makes_its_chunk_or_says_what_it_lacks(
    small: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows, seconds = session.work(small, small.chunk(0), tmp_path)
    assert rows == 2
    assert 0.0 < seconds < 10.0
    assert small.done(tmp_path) == {0}
    with pytest.raises(LeverError, match=f"has no folder {tmp_path}/not: it must be on a file system that all share"):
        session.work(small, small.chunk(0), tmp_path / "not")
    monkeypatch.setattr(session, "fingerprint", lambda _spec: "another")
    with pytest.raises(LeverError, match="has another build of lever-cdkf: install the same everywhere"):
        session.work(small, small.chunk(0), tmp_path)


@pytest.mark.parametrize(
    ("bokeh", "page"), [(object(), "http://a:1/status"), (None, "http://a:1/info/main/workers.html")]
)
def test_the_dashboard_is_what_dask_can_show(
    bokeh: object, page: str, small: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    client: Any = Client(small, set())
    client.dashboard_link = "http://a:1/status"
    monkeypatch.setattr("importlib.util.find_spec", lambda name: bokeh if name == "bokeh" else None)
    assert session.dashboard(client) == page


def test_no_scheduler_is_said_in_a_line() -> None:
    with (
        pytest.raises(LeverError, match="no Dask scheduler at nonsense://x: ValueError: "),
        session.connected("nonsense://x", 1),
    ):
        raise AssertionError


class Cluster:
    """Notes how it is started."""

    def __init__(self, **options: Any) -> None:
        self.options = options
        self.settings = {name: dask.config.get(f"distributed.{name}") for name in (
            "nanny.pre-spawn-environ", "worker.preload", "deploy.lost-worker-timeout", "logging.distributed"
        )}  # fmt: skip

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        self.closed = True


class Connected(Cluster):
    """A client of it, or of a scheduler."""

    threads: ClassVar[dict[str, int]] = {"a": 1}

    def __init__(self, of: Any, **options: Any) -> None:
        self.of, self.options = of, options

    def nthreads(self) -> dict[str, int]:
        return self.threads


@pytest.fixture
def dask_of_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("distributed.LocalCluster", Cluster)
    monkeypatch.setattr("distributed.Client", Connected)


@pytest.mark.usefixtures("dask_of_tests")
def test_workers_of_this_machine_are_as_many_as_asked_for_with_a_thread_each() -> None:
    """Each keeps the memory of its arrays, has no limit that would kill it, and may be slow to start again."""
    before = dask.config.get("distributed.worker.preload")
    with session.connected(None, 3) as made:
        client: Any = made
        cluster = client.of
    assert {name: cluster.options[name] for name in ("n_workers", "threads_per_worker", "memory_limit")} == {
        "n_workers": 3, "threads_per_worker": 1, "memory_limit": 0
    }  # fmt: skip
    assert cluster.options["dashboard_address"] == "127.0.0.1:0"
    assert cluster.options["silence_logs"] == logging.CRITICAL
    kept = str(256 * 2**20)
    assert cluster.settings["nanny.pre-spawn-environ"] == {
        "MALLOC_TRIM_THRESHOLD_": kept, "MALLOC_MMAP_THRESHOLD_": kept
    }  # fmt: skip
    assert cluster.settings["deploy.lost-worker-timeout"] == "300 s"
    assert cluster.settings["logging.distributed"] == "critical"
    (preloaded,) = cluster.settings["worker.preload"]
    compile(preloaded, "preload", "exec")
    assert cluster.closed
    assert client.closed
    assert dask.config.get("distributed.worker.preload") == before


@pytest.mark.usefixtures("dask_of_tests")
def test_a_scheduler_must_have_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    with session.connected("tcp://a:1", 1) as made:
        client: Any = made
    assert (client.of, client.options) == ("tcp://a:1", {"timeout": 10.0})
    monkeypatch.setattr(Connected, "threads", {})
    said = r"the scheduler at tcp://a:1 has no workers yet: start some \(dask worker tcp://a:1\)"
    with pytest.raises(LeverError, match=said), session.connected("tcp://a:1", 1):
        raise AssertionError
