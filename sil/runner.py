"""A whole simulation: the run over the bus, what comes out of it, and its files."""

from __future__ import annotations

import json
import time as clock
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
from lever_cdkf.host_tools.files import Outputs, make_folder, write_text, writing

from . import buslog, loop, summary, trace
from .buslog import Frames
from .loop import Progress
from .scenario import Scenario
from .trace import Trace


@dataclass(frozen=True)
class Result:
    """What a simulation gives: the columns of trace.csv, the content of summary.json, and every frame on the bus."""

    trace: Trace
    summary: dict[str, Any]
    frames: Frames


def simulate(
    scenario: Scenario,
    bus: can.BusABC,
    out_dir: Path | None = None,
    *,
    channel: str = "lever",
    realtime: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Runs `scenario` against the estimator on `bus` and judges it; with `out_dir` also writes bus.log, trace.csv,
    report.html and summary.json there, all or none. `channel` is the bus's name in bus.log.

    `realtime` paces the samples by the wall clock, otherwise they come as fast as they are answered. The run and its
    files but for the wall times are the same either way. Raises LeverError.
    """
    start = clock.perf_counter()
    if out_dir is not None:
        make_folder(out_dir)  # before a run that could then not be kept
    recording = loop.run(scenario, bus, realtime=realtime, progress=progress)
    frames = recording.frames()
    columns = trace.build(recording, frames)
    result = Result(columns, summary.build(recording, columns), frames)
    summary.add_wall_time(result.summary, clock.perf_counter() - start)
    if out_dir is not None:
        _write(result, out_dir, channel, start)
    return result


def _write(result: Result, folder: Path, channel: str, start: float) -> None:
    """Writes the files; summary.json comes last, so that its wall time is of everything."""
    from .report import write_report

    with Outputs(folder) as outputs:
        bus_log = outputs.path("bus.log")
        with writing(bus_log), bus_log.open("wb") as file:
            file.writelines(buslog.lines(result.frames, channel))
        trace_csv = outputs.path("trace.csv")
        with writing(trace_csv):
            trace.write_csv(result.trace, trace_csv)
        summary.add_wall_time(result.summary, clock.perf_counter() - start)
        write_report(result.trace, result.summary, outputs.path("report.html"))
        summary.add_wall_time(result.summary, clock.perf_counter() - start)
        text = json.dumps(result.summary, indent=2, ensure_ascii=False, allow_nan=False)
        write_text(outputs.path("summary.json"), text + "\n")
        outputs.finish()
