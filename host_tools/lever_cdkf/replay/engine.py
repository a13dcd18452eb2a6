"""A replay: the frames of a recording through the firmware, in recorded order, and its answers into what keeps them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from ..can import codec
from ..can.bulk import FRAME, RECORDED, SLOTS, Feeder, Frames, Rows
from ..can.estimator_frames import EstimatorFrames
from ..can.identity import Identity
from ..exports.signal_files import calendar
from ..firmware.aircraft import AircraftResponse
from ..firmware.library import enum_names
from ..firmware.native import Config, Estimator
from ..numeric.arrays import FloatArray
from ..report import write_page
from ..results import summary as summaries
from ..results.faults import OPTIONAL
from ..results.summary import RecordingSummary, ReplaySummary
from ..results.trace import Trace
from ..runtime.extras import missing
from ..runtime.files import Outputs, write_text
from ..runtime.provenance import printable, provenance
from ..signals.mapped_frames import MappedFrames, frames_for_estimator
from ..signals.reading import Reading
from .columns import Columns, model_numbers
from .commands_in_log import Commands
from .comparison import Comparison
from .outputs import FILES, SUMMARY, Folder
from .proof import OTHER_CHOICES, Proof
from .recorded_run import Kept, RecordedRun
from .repeats import Repeats
from .summary import Figures, failure, verdict, warning
from .timeline import Timeline

Progress = Callable[[int, int], None]
"""Called now and then with the bytes done and the bytes in all."""

_ROWS_AT_ONCE = 1 << 15


class _Sink(Protocol):
    def add(self, trace: Trace, /) -> None: ...


@dataclass(frozen=True)
class Options:
    """What a user may ask for."""

    config: Config = field(default_factory=Config)
    chosen: Mapping[str, str] = field(default_factory=dict)
    """Choices of `config` (model, estimator …) that no COMMAND in the log may change."""
    reading: Reading = field(default_factory=lambda: Reading(is_of_lever_dbc=True))
    """What is read; the sample period of logs that do not speak lever.dbc becomes `config`'s."""
    formats: Sequence[str] = ("csv",)
    """Of the signals, of formats.FORMATS."""
    aircraft: AircraftResponse | None = None
    """Whose margin to collective bounce is watched."""
    inputs: Sequence[str | Path] = ()
    """Files beside the logs that all this is from: settings, database, mapping."""
    tune_command: str = "lever tune LOG"
    """What tunes the settings to these logs, read in this way."""


def replay(
    logs: Iterable[str | Path],
    options: Options,
    out_dir: Path | None = None,
    progress: Progress | None = None,
    keep: Callable[[Mapping[str, FloatArray]], None] | None = None,
) -> ReplaySummary:
    """Replay logs, one after another in time, and return what summary.json says.

    With `out_dir` also write bus.log, the signals, report.html (with the extra `report`) and summary.json there, all or
    none, and hand the trace, reduced, to `keep`. Raise LeverError, also rather than write over a log.
    """
    logs = list(logs)
    traffic = frames_for_estimator(logs, options.reading, progress)
    if isinstance(traffic, MappedFrames):
        options = replace(options, config=traffic.at_its_rate(options.config))
    with ExitStack() as stack:
        folder = None
        if out_dir is not None:
            inputs = [*logs, *options.inputs]
            outputs = stack.enter_context(Outputs(out_dir, inputs, FILES))
            folder = stack.enter_context(Folder(outputs, options.formats, provenance(inputs)))
        replayed = _Replay(traffic, options, folder)
        replayed.run(progress)
        summary = replayed.summary()
        if folder is not None:
            summary = replayed.finish(folder, summary)
            if keep is not None:
                keep(replayed.kept.stretches.rows())
        return summary


class _Replay:
    """The parts, joined."""

    def __init__(self, traffic: EstimatorFrames | MappedFrames, options: Options, folder: Folder | None) -> None:
        self._traffic, self._options, self._folder = traffic, options, folder
        self._feeder = Feeder(self._new_estimator())
        self._proof = Proof(self._feeder.estimator, self._new_estimator, options.chosen)
        self._commands = Commands(options.config.choices, options.chosen)
        self._repeats = Repeats()
        self._timeline = Timeline(options.config.settings["sample_period"])
        self._columns: Columns | None = None
        self._sinks: list[_Sink] = []
        self._waiting: list[Rows] = []
        self._model_number = -1
        self._model_changes = 0
        self._recorded_contract: int | None = None
        self._recorded = Identity()
        self._other_contract = False

    def run(self, progress: Progress | None) -> None:
        """All of the recording."""
        recording = self._traffic.recording
        for frames in self._traffic.chunks():
            self._repeats.add(frames)
            self._identify(frames)
            self._feed(self._commands.applied(frames))
            if progress is not None:
                progress(recording.done, recording.size)
        self._feed(np.empty(0, FRAME), last=True)
        self._take(self._feeder.flush(), last=True)

    def _new_estimator(self) -> Estimator:
        estimator = Estimator(self._options.config)
        estimator.watch(self._options.aircraft)
        return estimator

    def _feed(self, frames: Frames, last: bool = False) -> None:
        self._proof.first_us = self._traffic.first_us
        for piece, snapshot in self._proof.pieces(frames, last):
            for fed, rows in self._feeder.feed(piece):
                if self._folder is not None:
                    self._folder.log(fed, self._traffic.channel or "")
                self._take(rows)
            if self._commands.changed:
                self._proof.counts.not_compared = OTHER_CHOICES
            if snapshot is not None:
                self._proof.compare(snapshot, int(piece["time_us"][-1]))

    def _identify(self, frames: Frames) -> None:
        """Which contract the recorded estimator speaks, by its first IDENTITY that says so, and its last choices."""
        data = frames["data"][frames["id"] == codec.message("IDENTITY").frame_id]
        fields = codec.decode_columns("IDENTITY", np.ascontiguousarray(data))
        said = {name: column[np.isfinite(column)] for name, column in fields.items()}
        if self._recorded_contract is None and len(said["contract"]):
            self._recorded_contract = int(said["contract"][0])
        self._recorded.take({name: float(column[-1]) for name, column in said.items() if len(column)})

    def _take(self, rows: Rows, last: bool = False) -> None:
        """Gather rows, so that what is done with columns pays."""
        self._waiting.append(rows)
        if last or sum(map(len, self._waiting)) >= _ROWS_AT_ONCE:
            gathered = np.concatenate(self._waiting)
            self._waiting.clear()
            if len(gathered):
                self._use(gathered)

    def _use(self, rows: Rows) -> None:
        if self._columns is None:
            self._columns = self._start(rows)
        for _, number in model_numbers(rows):
            if number != self._model_number:
                self._model_changes += 1
                self._model_number = number
        trace = self._columns.of(rows)
        for sink in self._sinks:
            sink.add(trace)
        if self._folder is not None:
            published = (rows["fresh"] >> SLOTS["PILOT_PARAMETERS"]) & 1 != 0
            recorded = (rows["fresh"] >> RECORDED["PILOT_PARAMETERS"]) & 1 != 0
            if not self._folder.signals.started:
                self._folder.signals.start(trace, int(rows["time_us"][0]), asdict(self._estimator()))
            self._folder.signals.add(trace, published, recorded)

    def _start(self, rows: Rows) -> Columns:
        """Start everything that has to know the model."""
        self._model_number = next((number for _, number in model_numbers(rows)), 0)
        self.model = enum_names("lever_model")[self._model_number]
        there = bool(np.any(rows["known"] >> min(RECORDED.values())))
        with_recorded = there and self._recorded_contract == codec.contract()
        self._other_contract = there and not with_recorded
        self.figures = Figures(self._options.config, self.model)
        self.kept = Kept(self._options.config.settings["sample_period"])
        self._sinks = [self.figures]
        self._comparison = Comparison(self.model) if with_recorded else None
        if self._comparison is not None:
            self._sinks.append(self._comparison)
        if self._folder is not None:
            self._sinks.append(self.kept)
        watched = self._options.aircraft is not None
        rated = self._options.config.settings["publish_test_ratios"] > 0.0
        return Columns(self._timeline, self.model, with_recorded, watched, rated, self._absent())

    def _absent(self) -> tuple[str, ...]:
        """Return faults of inputs that the mapping does not have."""
        if not isinstance(self._traffic, MappedFrames):
            return ()
        return tuple(fault for fault, key in OPTIONAL.items() if key not in self._traffic.loaded.inputs)

    # --- what comes of it ---------------------------------------------------------------------------------------------

    def summary(self) -> ReplaySummary:
        """Return the content of summary.json, but for the provenance of files."""
        figures, health, aircraft = self.figures, self._feeder.estimator.health(), self._options.aircraft
        summary = ReplaySummary(
            estimator=self._estimator(),
            samples=self._timeline.clocks.samples,
            lost=health.lost,
            corrupt=health.corrupt,
            late=health.late,
            restarts=health.recoveries,
            nis=figures.nis(),
            whiteness=figures.whiteness(),
            stability=None if aircraft is None else figures.bounce.summary(aircraft),
            modes_s=figures.modes_s(),
            passed=False,
            verdict="",
            recording=self._recording(),
            fault_shares=figures.fault_shares(),
            flagged_share=figures.faults.warned_share,
            estimates=figures.estimates(),
            comparison=None if self._comparison is None else self._comparison.summary(),
            snapshots=self._proof.summary(),
        )
        said = warning(summary, self._options.tune_command, figures.evidence)
        summary = replace(summary, passed=not failure(summary), warning=said)
        return replace(summary, verdict=verdict(summary))

    def _estimator(self) -> summaries.Estimator:
        choices = self._commands.choices
        if self._proof.counts.begun_at_s is not None:
            choices |= self._recorded.choices  # COMMANDs before the log
        choices |= {"model": self.model}
        return summaries.Estimator(**choices, settings=dict(self._options.config.settings))

    def _recording(self) -> RecordingSummary:
        traffic, clocks = self._traffic, self._timeline.clocks
        recording = traffic.recording
        first, last = traffic.first_us, traffic.last_us
        return RecordingSummary(
            logs=[printable(Path(path).name) for path in recording.paths],
            channel=traffic.channel,
            start=_calendar(first),
            duration_s=(last - first) * 1e-6,
            frames=traffic.frames,
            frames_left_out={kind: count for kind, count in traffic.others.items() if count},
            corrupt_recorded_answers=traffic.corrupt_answers,
            answers_of_other_contract=self._other_contract,
            misplaced_answers=0 if self._columns is None else self._columns.misplaced,
            damaged_lines=recording.damaged,
            ends_early=[_without_folder(reason) for reason in recording.ends_early],
            refused=self._feeder.refused,
            repeated=self._repeats.count,
            commands=self._commands.count,
            commands_changed=self._commands.changed,
            model_changes=self._model_changes,
            other_buses_with_samples=sorted(traffic.other_samples),
            typical_step_s=self._timeline.typical_step_us * 1e-6,
            gaps=clocks.gaps,
            longest_gap_s=clocks.longest_gap_s,
            late_samples=clocks.late,
            clock_wraps=clocks.wraps,
            clock_restarts=clocks.restarts,
            recorder_clock_jumps=clocks.recorder_jumps,
            mapping=traffic.loaded.summary() if isinstance(traffic, MappedFrames) else None,
        )

    def finish(self, folder: Folder, summary: ReplaySummary) -> ReplaySummary:
        """Complete the files and put them into place; return the summary with their provenance."""
        summary = replace(summary, provenance=folder.complete())
        if not missing("report"):
            write_page(RecordedRun(self.kept, summary), folder.outputs.path("report.html"))
        write_text(folder.outputs.path(SUMMARY), summaries.text(summary))
        folder.outputs.finish()
        return summary


def _calendar(time_us: int) -> str | None:
    moment = calendar(time_us // 1_000_000 * 1_000_000)
    return None if moment is None else moment.strftime("%Y-%m-%d %H:%M:%S UTC")


def _without_folder(reason: str) -> str:
    """Return a reason that begins with the path of a log: the same wherever that is."""
    path, colon, rest = reason.partition(": ")
    return printable(f"{Path(path).name}{colon}{rest}")
