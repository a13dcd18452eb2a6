"""A whole simulation: the run over the bus, what comes out of it, and its files."""

from __future__ import annotations

import json
import time as clock
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
from lever_cdkf.host_tools.can.bus import LeverBus
from lever_cdkf.host_tools.files import make_folder, replace_file
from lever_cdkf.host_tools.results import trace
from lever_cdkf.host_tools.results.trace import Trace

from ..scenarios.scenario import Scenario
from . import buslog, loop, summary
from .buslog import Frames
from .columns import columns_of
from .loop import Progress


@dataclass(frozen=True)
class Result:
    """What a simulation gives: the columns of trace.csv, the content of summary.json, and every frame on the bus."""

    trace: Trace
    summary: dict[str, Any]
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
    it; with `out_dir` also writes bus.log, trace.csv, report.html and summary.json there, each complete or not at all.
    `channel` is the bus's name in bus.log.

    `realtime` paces the samples by the wall clock, otherwise they come as fast as they are answered. The run and its
    files but for the wall times are the same either way. Raises LeverError.
    """
    start = clock.perf_counter()
    if out_dir is not None:
        make_folder(out_dir)  # before a run that could then not be kept
    with ExitStack() as stack:
        estimator = bus or stack.enter_context(LeverBus(channel, config=scenario.config))
        recording = loop.run(scenario, estimator, realtime=realtime, progress=progress)
    frames = recording.frames()
    columns = columns_of(recording, frames)
    result = Result(columns, summary.build(recording, columns), frames)
    summary.add_wall_time(result.summary, clock.perf_counter() - start)
    if out_dir is not None:
        _write(result, out_dir, channel, start)
    return result


def _write(result: Result, folder: Path, channel: str, start: float) -> None:
    """Writes the files; summary.json comes last, so that its wall time is of everything."""
    from lever_cdkf.host_tools.report import write_report

    def bus_log(path: Path) -> None:
        with path.open("wb") as file:
            file.writelines(buslog.lines(result.frames, channel))

    def summary_json(path: Path) -> None:
        text = json.dumps(result.summary, indent=2, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8")

    replace_file(folder / "bus.log", bus_log)
    replace_file(folder / "trace.csv", lambda path: trace.write_csv(result.trace, path))
    summary.add_wall_time(result.summary, clock.perf_counter() - start)
    replace_file(folder / "report.html", lambda path: write_report(result.trace, result.summary, path))
    summary.add_wall_time(result.summary, clock.perf_counter() - start)
    replace_file(folder / "summary.json", summary_json)
