"""A whole simulation: the run over the bus, what comes out of it, and its files."""

from __future__ import annotations

import time as clock
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import can
from lever_cdkf.host_tools.can.bus import LeverBus
from lever_cdkf.host_tools.extras import missing
from lever_cdkf.host_tools.files import Outputs, make_folder, write_text, writing
from lever_cdkf.host_tools.results import trace
from lever_cdkf.host_tools.results.summary import SimulationSummary, text
from lever_cdkf.host_tools.results.trace import Trace

from ..scenarios.scenario import Scenario
from . import buslog, in_process, loop, summary
from .buslog import Frames
from .columns import columns_of
from .loop import Progress


@dataclass(frozen=True)
class Result:
    """What a simulation gives: the columns of trace.csv, the content of summary.json, and every frame on the bus."""

    trace: Trace
    summary: SimulationSummary
    frames: Frames


def simulate(
    scenario: Scenario,
    bus: can.BusABC | None = None,
    out_dir: Path | None = None,
    *,
    channel: str = "lever",
    realtime: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Runs `scenario` against the estimator on `bus`, or without one against the firmware in this process, and judges
    it; with `out_dir` also writes bus.log, trace.csv, report.html (with the extra `report`) and summary.json there,
    all or none. `channel` is the bus's name in bus.log.

    `realtime` paces the samples by the wall clock, otherwise they come as fast as they are answered. The run and its
    files but for the wall times are the same either way. Raises LeverError.
    """
    start = clock.perf_counter()
    if out_dir is not None:
        make_folder(out_dir)  # before a run that could then not be kept
    if bus is None and not realtime:
        recording = in_process.run(scenario, channel, progress)
    else:
        with ExitStack() as stack:
            estimator = bus or stack.enter_context(LeverBus(channel, config=scenario.config))
            recording = loop.run(scenario, estimator, realtime=realtime, progress=progress)
    frames = recording.frames()
    columns = columns_of(recording, frames)
    untimed = summary.build(recording, columns)
    if out_dir is not None:
        _write(Result(columns, untimed, frames), out_dir, channel, start)
    return Result(columns, untimed.timed(clock.perf_counter() - start), frames)


def _write(result: Result, folder: Path, channel: str, start: float) -> None:
    """Writes the files; summary.json comes last, so that its wall time is of everything."""
    from lever_cdkf.host_tools.report import write_report

    def elapsed() -> SimulationSummary:
        return result.summary.timed(clock.perf_counter() - start)

    with Outputs(folder, names=("report.html",)) as outputs:
        bus_log = outputs.path("bus.log")
        with writing(bus_log), bus_log.open("wb") as file:
            file.writelines(buslog.lines(result.frames, channel))
        trace_csv = outputs.path("trace.csv")
        with writing(trace_csv):
            trace.write_csv(result.trace, trace_csv)
        if not missing("report"):
            write_report(result.trace, elapsed(), outputs.path("report.html"))
        write_text(outputs.path("summary.json"), text(elapsed()))
        outputs.finish()
