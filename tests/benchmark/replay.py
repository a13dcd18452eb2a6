"""How fast an hour is replayed, and in how much memory: `cmake --build build --target replay_benchmark`.

Makes a log of an hour at 1 kHz (7.2 million frames) out of a simulated minute, replays it with `lever replay` on one
core, without files and with all of them, and feeds the first minutes of it to the estimator frame by frame by
python-can, on the same core, likewise without files and with two of them. Prints times, the largest memory, and the
ratio of processor times. Takes two minutes and 2 GB of disk.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import can
import numpy as np
from lever_cdkf.can import bulk, codec
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.can.logs import Recording
from lever_cdkf.cli.tables import Row, print_tables
from lever_sil.run.runner import simulate
from lever_sil.scenarios import scenario

START_US = 1_700_000_000_000_000
MINUTE_US = 60_000_000


def simulated_minute(folder: Path) -> bulk.Frames:
    """Return the frames that a simulation has sent to the estimator in a minute."""
    steady = scenario.load("steady", ["duration=60 s"])
    with LeverBus("lever", config=steady.config) as bus:
        simulate(steady, bus, folder)
    frames = np.concatenate(list(Recording([folder / "bus.log"]).chunks()))
    return frames[np.isin(frames["id"], [codec.message(name).frame_id for name in ("LEVER_SAMPLE", "BASE_SAMPLE")])]


def shifted(minute: bulk.Frames, number: int) -> bulk.Frames:
    """Return the same samples `number` minutes later; 60 000 of them leave the counters as they are."""
    frames = minute.copy()
    frames["time_us"] += START_US + number * MINUTE_US
    encode = codec.encoder("BASE_SAMPLE")
    base = np.flatnonzero(frames["id"] == codec.message("BASE_SAMPLE").frame_id)
    fields = codec.decode_columns("BASE_SAMPLE", frames["data"][base])
    columns = (fields["counter"].tolist(), fields["z_ddot"].tolist(), fields["time_us"].tolist())
    data = [encode(int(counter), z, int(us) + number * MINUTE_US) for counter, z, us in zip(*columns, strict=True)]
    frames["data"][base] = np.frombuffer(b"".join(data), np.uint8).reshape(-1, 8)
    return frames


MEASURED = """
import resource, sys
from lever_cdkf.cli.main import main
status = main(sys.argv[1:])
used = resource.getrusage(resource.RUSAGE_SELF)
with open("/proc/self/status") as file:  # ru_maxrss would be this process's or its parent's, whichever was larger
    memory = next(line.split()[1] for line in file if line.startswith("VmHWM"))
print(status, used.ru_utime + used.ru_stime, memory, file=sys.stderr)
"""


def lever(*arguments: str | Path) -> tuple[float, float, float]:
    """Wall time [s], processor time [s] and largest memory [MB] of a command."""
    start = time.perf_counter()
    command = [sys.executable, "-c", MEASURED, *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=True)
    status, processor, kilobytes = done.stderr.splitlines()[-1].split()
    if status != "0":
        sys.exit(done.stderr)
    return time.perf_counter() - start, float(processor), float(kilobytes) / 1024


def frame_by_frame(log: Path, frames: int, folder: Path | None) -> tuple[float, float]:
    """Wall and processor time [s] that python-can's reader and bus take for the first frames; nothing is done with the
    answers, or with `folder` they are written into a log and, decoded, into a table with a row for each sample."""
    start, used = time.perf_counter(), time.process_time()
    with ExitStack() as stack:
        reader = stack.enter_context(can.LogReader(log))
        bus = stack.enter_context(LeverBus("lever"))
        keep = stack.enter_context(_files(folder)) if folder is not None else None
        for message in itertools.islice(reader, frames):
            bus.send(message)
            if keep is not None:
                keep(message)
            while (answer := bus.recv(0.0)) is not None:
                if keep is not None:
                    keep(answer)
    return time.perf_counter() - start, time.process_time() - used


@contextmanager
def _files(folder: Path) -> Iterator[Callable[[can.Message], None]]:
    """bus.log by python-can and trace.csv by the standard library, as a script would write them."""
    with can.CanutilsLogWriter(folder / "bus.log") as log, (folder / "trace.csv").open("w", newline="") as file:
        table, row = csv.writer(file), dict[str, float]()

        def keep(message: can.Message) -> None:
            log.on_message_received(message)
            name, fields = codec.decode(message.arbitration_id, message.data)
            row.update({f"{name}.{field}": value for field, value in fields.items()})
            if name == "STATE_ESTIMATE":
                table.writerow([f"{value:.6f}" for value in row.values()])

        yield keep


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=int, default=60, help="of the log (default: %(default)s)")
    parser.add_argument("--by-frame", type=int, default=2, help="minutes of it that go frame by frame (default: 2)")
    minutes, by_frame = (options := parser.parse_args()).minutes, min(options.by_frame, options.minutes)
    os.environ["POLARS_MAX_THREADS"] = "1"
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    folder = Path(tempfile.mkdtemp(prefix="lever-benchmark-"))
    try:
        minute = simulated_minute(folder)
        log = folder / "hour.log"
        with log.open("wb") as file:
            for number in range(minutes):
                file.write(bulk.format_lines(shifted(minute, number), "can0").data)
        everything = lever("replay", log, "-o", folder / "out")
        estimates = lever("replay", log)
        count = by_frame * len(minute)
        plain = [value * minutes / by_frame for value in frame_by_frame(log, count, None)]
        with_files = [value * minutes / by_frame for value in frame_by_frame(log, count, folder)]
    finally:
        shutil.rmtree(folder)
    rows: list[Row] = [
        {
            "what": what,
            "wall time [s]": wall,
            "processor time [s]": processor,
            "memory [MB]": memory,
            "ratio [1]": ratio,
        }
        for what, (wall, processor, memory), ratio in (
            ("lever replay", estimates, 1.0),
            (f"python-can frame by frame (from {by_frame} min)", (*plain, None), plain[1] / estimates[1]),
            ("lever replay -o DIR (five files)", everything, 1.0),
            ("python-can frame by frame, bus.log and trace.csv", (*with_files, None), with_files[1] / everything[1]),
        )
    ]
    print_tables({f"{minutes} min at 1 kHz, {minutes * len(minute):,} frames, one core": rows})
    return 0


if __name__ == "__main__":
    sys.exit(main())
