"""A whole simulation: the run over the bus, what comes out of it, and its files."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import can
import numpy as np
from lever_cdkf.can.bus import LeverBus
from lever_cdkf.cli.formats import FORMATS
from lever_cdkf.errors import LeverError
from lever_cdkf.exports.signal_files import SignalFiles
from lever_cdkf.results.summary import SimulationSummary, text
from lever_cdkf.results.trace import Trace
from lever_cdkf.runtime.extras import missing
from lever_cdkf.runtime.files import Outputs, made_folder, write_text, writing
from lever_cdkf.runtime.provenance import provenance
from numpy.typing import NDArray

from ..scenarios.scenario import Scenario
from . import buslog, in_process, loop, summary
from .buslog import Frames
from .columns import columns_of, published
from .loop import Progress, Recording

if TYPE_CHECKING:
    from lever_cdkf.report.page import Story

_BOUND = 1e9
"""[m/s^2, rad, rad/s, N m]"""


@dataclass(frozen=True)
class SimulationResult:
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
    formats: Sequence[str] = ("csv",),
    inputs: Sequence[str | Path] = (),
    story: Callable[[], Story] | None = None,
    snapshots: float | None = None,
) -> SimulationResult:
    """Run `scenario` against the estimator on `bus`, or without one against the firmware in this process, and judge it.

    The run and its files, but for wall times, are the same at any pace.

    Parameters
    ----------
    scenario
        What load_scenario() has returned.
    bus
        A bus of python-can with an estimator on it; None: the firmware in this process.
    out_dir
        The folder for bus.log, the signals, report.html (with the extra `report`) and summary.json, all or none; None:
        no files.
    channel
        The name of the bus in bus.log.
    realtime
        Pace the samples by the wall clock; otherwise they come as fast as they are answered.
    progress
        Is told how far it is.
    formats
        Of the signals: keys of formats.FORMATS.
    inputs
        Files that the scenario is from.
    story
        Makes a first picture for the report.
    snapshots
        How often the firmware in this process sends its state [s]; None: never.

    Returns
    -------
    SimulationResult
        The trace with a column for each signal, the judgement, and every frame.

    Raises
    ------
    LeverError
        The estimator does not answer or refuses a COMMAND, the motion grows beyond all bounds, or a file cannot be
        written.
    """
    if not isinstance(scenario, Scenario):
        raise LeverError(f"scenario is a {type(scenario).__name__}: give what load_scenario({scenario!r}) returns")
    start = clock.perf_counter()
    with ExitStack() as stack:
        stack.enter_context(made_folder(out_dir))  # before a run that could then not be kept
        if bus is None and not realtime:
            recording = in_process.run(scenario, channel, progress, snapshots)
        else:
            config, aircraft = scenario.config, scenario.known_aircraft
            estimator = bus or stack.enter_context(
                LeverBus(channel, config=config, aircraft=aircraft, snapshots=snapshots)
            )
            recording = loop.run(scenario, estimator, realtime=realtime, progress=progress)
            recording.has_aircraft = isinstance(estimator, LeverBus)
        _check_bounded(recording)
        frames = recording.frames()
        columns = columns_of(recording, frames)
        judged = summary.build(recording, columns).timed(clock.perf_counter() - start)
        result = SimulationResult(columns, judged, frames)
        if out_dir is not None:
            files = _Files(out_dir, channel, formats, inputs, story)
            files.write(result, published(recording, frames))
    return result


def _check_bounded(recording: Recording) -> None:
    """Raise LeverError for a run that no arithmetic can judge."""
    inputs = recording.inputs
    signals = {"z_ddot": inputs.z_ddot, "theta": recording.theta, "theta_dot": recording.theta_dot}
    for name, signal in (signals | {"tau_m": recording.tau_m}).items():
        beyond = np.flatnonzero(~(np.abs(signal) < _BOUND))
        if len(beyond):
            raise LeverError(
                f"{recording.scenario.file}: {name} grows beyond all bounds at {inputs.time[beyond[0]]:.4g} s: what "
                "acts there, the pilot or the aircraft is out of scale (a wrong unit?)"
            )


@dataclass(frozen=True)
class _Files:
    """What is to be written."""

    folder: Path
    channel: str
    formats: Sequence[str]
    inputs: Sequence[str | Path]
    story: Callable[[], Story] | None

    def write(self, result: SimulationResult, published: NDArray[np.bool_]) -> None:
        """Write the files."""
        from lever_cdkf.report import write_report

        origin = provenance(self.inputs)
        with Outputs(self.folder, self.inputs, ("report.html", *FORMATS.values())) as outputs:
            bus_log = outputs.path("bus.log")
            with writing(bus_log), bus_log.open("wb") as file:
                file.writelines(buslog.lines(result.frames, self.channel))
            with SignalFiles(self.formats, outputs.path, origin) as signals:
                signals.start(result.trace, 0, asdict(result.summary.estimator))
                signals.add(result.trace, published, np.zeros_like(published))
                signals.close()
            origin = origin.with_outputs(outputs.written("bus.log", FORMATS["csv"]))
            summary = replace(result.summary, provenance=origin)
            if not missing("report"):
                story = None if self.story is None else self.story()
                write_report(result.trace, summary, outputs.path("report.html"), story)
            write_text(outputs.path("summary.json"), text(summary))
            outputs.finish()
