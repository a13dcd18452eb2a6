"""What large campaigns take, on paper: from the time of a run, the size of a row and the cost of a chunk, measured.

    python tests/benchmark/campaign.py [--chunks N] [--price DOLLARS]

The chunks are empty, so that what is measured is Dask alone: client and scheduler in one process, two workers.
"""

from __future__ import annotations

import argparse
import dataclasses
import resource
import sys
import tempfile
import time
from pathlib import Path

from lever_cdkf.host_tools.tables import Row, print_tables
from lever_cdkf.sil.campaign import chunks, session, spec
from lever_cdkf.sil.campaign.chunks import Chunk, Plan

RUNS, CORES = (10**6, 10**9), (100, 1000)
_MEASURED = 200  # flights of a minute


def nothing(plan: Plan, chunk: Chunk, folder: Path) -> tuple[int, float]:
    """A chunk that is done at once."""
    del plan, chunk, folder
    return 1, 0.0


def cost_of_a_run() -> tuple[float, float]:
    """Processor time of a minute of flight with the dual estimator [s], and bytes of its row."""
    plan = Plan(dataclasses.replace(spec.load("tracking"), estimators=("dual",)))
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        chunks.make(plan, Chunk(0, _MEASURED), Path(folder))
        seconds = time.process_time() - start
        (file,) = Path(folder).glob("*.parquet")
        return seconds / _MEASURED, file.stat().st_size / _MEASURED


def cost_of_a_chunk(count: int) -> tuple[float, float]:
    """Time from one empty chunk to the next [s], and processor time of client and scheduler for it [s]."""
    quick = spec.load("quick")
    plan = Plan(dataclasses.replace(quick, seeds=1, chunk=1, design="random", points=count, vary=()))
    session.work = nothing
    with session.connected(None, 2) as client:
        start, own = time.perf_counter(), time.process_time()
        session.run(plan, Path("nowhere"), client, lambda *_: None)
        return (time.perf_counter() - start) / count, (time.process_time() - own) / count


def on_paper(runs: int, cores: int, run: float, row: float, chunk: float, price: float) -> Row:
    """A campaign of minutes with one estimator, in chunks as they come by default."""
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
    parser.add_argument("--price", type=float, default=0.04, help="of an hour of a core [$] (default: %(default)s)")
    args = parser.parse_args()
    run, row = cost_of_a_run()
    each, chunk = cost_of_a_chunk(args.chunks)
    measured: Row = {
        "a run [ms]": 1e3 * run,
        "× real time": 60.0 / run,
        "a row [bytes]": row,
        "a chunk, two workers [ms]": 1e3 * each,
        "of it client and scheduler [ms]": 1e3 * chunk,
        "client and scheduler [MB]": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }
    campaigns = [on_paper(runs, cores, run, row, chunk, args.price) for runs in RUNS for cores in CORES]
    print_tables({"measured": [measured], "campaigns of minutes": campaigns})
    return 0


if __name__ == "__main__":
    sys.exit(main())
