"""How fast an hour is replayed, and in how much memory: `cmake --build build --target replay_benchmark`.

Makes a log of an hour at 1 kHz (7.2 million frames) out of a simulated minute, replays it with `lever replay` on one
core, once for all files and once for the estimates alone, and feeds the first minutes of it to the estimator frame by
frame by python-can, on the same core. Prints times, their ratio and the largest memory. Takes two minutes and 2 GB of
disk.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import can
import numpy as np
from lever_cdkf.host_tools import bulk, codec
from lever_cdkf.host_tools.bus import LeverBus
from lever_cdkf.host_tools.logs import Recording
from lever_cdkf.host_tools.tables import Row, print_tables
from lever_cdkf.sil import scenario
from lever_cdkf.sil.runner import simulate

START_US = 1_700_000_000_000_000
MINUTE_US = 60_000_000


def simulated_minute(folder: Path) -> bulk.Frames:
    """The frames that a simulation has sent to the estimator in a minute."""
    steady = scenario.load("steady", ["duration=60 s"])
    with LeverBus("lever", config=steady.config) as bus:
        simulate(steady, bus, folder)
    frames = np.concatenate(list(Recording([folder / "bus.log"]).chunks()))
    return frames[np.isin(frames["id"], [codec.message(name).frame_id for name in ("LEVER_SAMPLE", "BASE_SAMPLE")])]


def shifted(minute: bulk.Frames, number: int) -> bulk.Frames:
    """The same samples `number` minutes later; 60 000 of them leave the counters as they are."""
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
from lever_cdkf.host_tools import cli
status = cli.main(sys.argv[1:])
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


def frame_by_frame(log: Path, frames: int) -> tuple[float, float]:
    """Wall and processor time [s] that python-can's reader and bus take for the first frames, and nothing else done."""
    start, used = time.perf_counter(), time.process_time()
    with can.LogReader(log) as reader, LeverBus("lever") as bus:
        for message, _ in zip(reader, range(frames), strict=False):
            bus.send(message)
            while bus.recv(0.0) is not None:
                pass
    return time.perf_counter() - start, time.process_time() - used


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
        wall, cpu = (value * minutes / by_frame for value in frame_by_frame(log, by_frame * len(minute)))
    finally:
        shutil.rmtree(folder)
    rows: list[Row] = [
        {"what": what, "wall time [s]": w, "processor time [s]": c, "times faster [1]": cpu / c, "memory [MB]": m}
        for what, (w, c, m) in {
            "lever replay -o DIR (five files)": everything,
            "lever replay (estimates only)": estimates,
            f"python-can frame by frame (from {by_frame} min)": (wall, cpu, None),
        }.items()
    ]
    print_tables({f"{minutes} min at 1 kHz, {minutes * len(minute):,} frames, one core": rows})
    return 0


if __name__ == "__main__":
    sys.exit(main())
