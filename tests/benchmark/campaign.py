"""What large campaigns take, on paper: from the time of a run, the size of a row and the cost of a chunk, measured.

    python tests/benchmark/campaign.py [--chunks N] [--rows N] [--flights N] [--price DOLLARS]

The chunks are empty, so that what is measured is Dask alone: client and scheduler in one process, two workers. Memory
is the peak of a process: of a worker that makes a chunk of `tracking`, and of what sums up and maps rows that are drawn
at random. For Linux.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from lever_cdkf.cli.tables import Row, print_tables
from lever_sil.campaign import chunks, design, maps, session, spec, summary
from lever_sil.campaign.chunks import Chunk, Plan

RUNS, CORES = (10**6, 10**9), (100, 1000)


def nothing(plan: Plan, chunk: Chunk, folder: Path) -> tuple[int, float]:
    """Return a chunk that is done at once."""
    del plan, chunk, folder
    return 1, 0.0


def cost_of_a_run(flights: int) -> tuple[float, float]:
    """Processor time of a minute of flight with the dual estimator [s], and bytes of its row."""
    plan = Plan(dataclasses.replace(spec.load("tracking"), estimators=("dual",)))
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        chunks.make(plan, Chunk(0, flights), Path(folder))
        seconds = time.process_time() - start
        (file,) = Path(folder).glob("*.parquet")
        return seconds / flights, file.stat().st_size / flights


def cost_of_a_chunk(count: int) -> tuple[float, float]:
    """Return time from one empty chunk to the next [s], and processor time of client and scheduler for it [s]."""
    quick = spec.load("quick")
    plan = Plan(dataclasses.replace(quick, seeds=1, chunk=1, design="random", points=count, vary=()))
    session.work = nothing
    with session.connected(None, 2) as client:
        start, own = time.perf_counter(), time.process_time()
        session.run(plan, Path("nowhere"), client, lambda *_: None)
        return (time.perf_counter() - start) / count, (time.process_time() - own) / count


def memory() -> int:
    """Return peak of this process [MB]."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.partition("VmHWM:")[2].split()[0]) // 1024  # ru_maxrss counts the process that started it, too


def memory_of(call: Callable[..., None], *arguments: Any) -> int:
    """Return peak of a new process that does this [MB]."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        pool.submit(call, *arguments).result()
        return pool.submit(memory).result()


def make_chunk(flights: int, folder: Path) -> None:
    """Do what a worker does, for no more flights than these."""
    plan = Plan(spec.load("tracking"))
    chunks.make(plan, Chunk(0, min(flights, plan.chunk(0).end)), folder)


def of_rows(count: int) -> Plan:
    """`tracking` with so many rows, or some more."""
    tracking = spec.load("tracking")
    return Plan(dataclasses.replace(tracking, seeds=math.ceil(count * tracking.seeds / tracking.runs)))


def draw_rows(count: int, folder: Path) -> None:
    """Files of rows whose figures are random."""
    plan, random = of_rows(count), np.random.default_rng(1)
    schema, names = chunks.schema(plan), plan.spec.estimators
    points = [design.columns(plan.spec, design.point(plan.spec, number)) for number in range(plan.spec.size)]
    for number in range(plan.count):
        chunk = plan.chunk(number)
        runs = np.arange(chunk.first * len(names), chunk.end * len(names))
        flight = runs // len(names)
        point = flight // plan.spec.seeds
        columns: dict[str, Any] = {
            field.name: random.random(len(runs)) for field in schema if pa.types.is_floating(field.type)
        }
        columns |= {key: np.array([points[each][key] for each in point]) for key in points[0]}
        columns |= {"run": runs, "point": point, "seed": flight + plan.spec.seed}
        columns |= {"estimator": np.array(names)[runs % len(names)], "error": np.full(len(runs), None)}
        pq.write_table(pa.table(columns, schema), folder / chunk.name(plan.fingerprint), compression="zstd")


def sum_up(count: int, folder: Path) -> None:
    """Do what `lever campaign` does when all rows are there."""
    plan = of_rows(count)
    plan.done(folder)
    summary.build(plan, folder, session.Session())
    summary.by_estimator(plan, folder)
    summary.errors(folder)
    maps.write(plan, folder)


def memories(rows: int, flights: int) -> Row:
    """Return the memories of a campaign with so many rows [MB]."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        worker = memory_of(make_chunk, flights, folder)
        for file in folder.iterdir():
            file.unlink()
        draw_rows(rows, folder)
        return {"rows": rows, "a worker [MB]": worker, "summing up [MB]": memory_of(sum_up, rows, folder)}


def on_paper(runs: int, cores: int, run: float, row: float, chunk: float, price: float) -> Row:
    """Return a campaign of minutes with one estimator, in chunks as they come by default."""
    files = runs * run / chunks.WORK
    working, scheduling = runs * run / cores, files * chunk
    return {
        "runs": f"{runs:.0e}",
        "cores": cores,
        "chunks": round(files),
        "workers [h]": working / 3600.0,
        "scheduler [h]": scheduling / 3600.0,
        "takes [h]": max(working, scheduling) / 3600.0,
        "bottleneck": "workers" if working > scheduling else "scheduler",
        "data [GB]": runs * row / 1e9,
        "costs [$]": runs * run / 3600.0 * price,
    }


def main() -> int:
    """Measures, and prints a row for each campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--chunks", type=int, default=10_000, help="empty chunks (default: %(default)s)")
    parser.add_argument("--rows", type=int, default=10**6, help="rows to sum up (default: %(default)s)")
    parser.add_argument("--flights", type=int, default=200, help="of a minute, to measure with (default: %(default)s)")
    parser.add_argument("--price", type=float, default=0.04, help="of an hour of a core [$] (default: %(default)s)")
    args = parser.parse_args()
    run, row = cost_of_a_run(args.flights)
    each, chunk = cost_of_a_chunk(args.chunks)
    measured: Row = {
        "a run [ms]": 1e3 * run,
        "× real time": 60.0 / run,
        "a row [bytes]": row,
        "a chunk, two workers [ms]": 1e3 * each,
        "of it client and scheduler [ms]": 1e3 * chunk,
        "client and scheduler [MB]": memory(),
    }
    campaigns = [on_paper(runs, cores, run, row, chunk, args.price) for runs in RUNS for cores in CORES]
    print_tables(
        {"measured": [measured], "memory": [memories(args.rows, args.flights)], "campaigns of minutes": campaigns}
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
