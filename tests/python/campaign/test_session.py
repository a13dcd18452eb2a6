"""A session with Dask, against a client that fails as Dask's does."""

from __future__ import annotations

import queue
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from distributed import KilledWorker
from lever_cdkf.cli.main import main
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
