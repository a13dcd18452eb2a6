"""From logs or a file to samples: what is asked for, and what was found."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..can.estimator_frames import LATE
from ..can.logs import Recording
from ..errors import LeverError
from ..results.summary import Mapped, MessageCounts
from ..text.suggestions import nearest_names
from .bus_signals import BusSignals, find, load_database
from .clock import RunningClock
from .inputs import Input, recorded_samples, understood
from .mapping import Mapping
from .named_columns import mapping_by_name
from .recorded import Signal, notes_of
from .resample import Samples
from .tables import is_table, read_table
from .units import split_name

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Reading:
    """How samples are made of a log or file, and of which part of it."""

    mapping: Mapping | None = None
    """None: a file that this tool has written, whose columns it knows; or a log of lever.dbc."""
    database: str | None = None
    """Path of the DBC, for logs of a bus."""
    channel: str | None = None
    """The bus with the samples; by default the only one that has any."""
    clock: str | None = None
    start: float = 0.0
    """[s] since the first frame or row."""
    length: float = float("inf")
    is_of_lever_dbc: bool = False
    """Its frames are the estimator's own: nothing is mapped. COMMAND frames before the part count."""


@dataclass
class Table:
    """A file of columns as a Recording that has been read."""

    paths: list[str]
    damaged: int = 0
    ends_early: list[str] = field(default_factory=list)
    done: int = 1
    size: int = 1


@dataclass
class Loaded:
    """The samples, and where they come from."""

    samples: Samples
    inputs: dict[str, Input]
    notes: list[str]
    """What was guessed or is odd, a sentence each."""
    recording: Recording | Table
    buses: list[str]
    frames: int
    """Of the part of the log, or rows of that of the file."""
    used: int
    """Frames of mapped messages."""
    counts: dict[str, MessageCounts] = field(default_factory=dict)
    """By mapped message."""
    unprotected: int = 0
    """Frames of mapped messages without E2E protection in the mapping."""
    times: dict[str, str] = field(default_factory=dict)
    """Of a file: unit of each column of time."""

    def summary(self) -> Mapped:
        """Return what summary.json says of it."""
        return Mapped(
            inputs={key: each.summary(self.samples, key) for key, each in self.inputs.items()},
            times=self.times,
            clock=self.samples.clock,
            sample_period_s=self.samples.period,
            disordered_values=self.samples.disordered,
            messages=self.counts,
            unprotected_frames=self.unprotected,
            notes=self.notes,
        )


def read(logs: Sequence[str | Path], reading: Reading, progress: Progress | None = None) -> Loaded:
    """Return samples of recorded logs, one after another in time, or of one file of columns. Raise LeverError."""
    paths = [str(path) for path in logs]
    for path in paths:
        _check_there(path)
    if any(is_table(path) for path in paths):
        if len(paths) > 1:
            raise LeverError(f"{', '.join(paths)}: files of columns are recordings of their own: add --each")
        return _of_table(paths[0], reading)
    if reading.database is None:
        raise LeverError(f"{paths[0]}: --map needs the database of its messages: add --dbc FILE")
    if reading.mapping is None:
        raise LeverError(
            f"--dbc needs --map KEY=MESSAGE.SIGNAL: `lever map {paths[0]} --dbc {reading.database}` proposes it"
        )
    return _of_bus(paths, reading, reading.mapping, reading.database, progress)


def _of_bus(paths: list[str], reading: Reading, mapping: Mapping, file: str, progress: Progress | None) -> Loaded:
    database = load_database(file)
    fields = {key: find(database, source.signal, file) for key, source in mapping.sources.items()}
    reader = BusSignals(database, fields.values(), mapping.protected)
    recording = Recording(paths, translated=False)
    frames, set_back = _collect(reader, recording, reading.start, reading.length, progress)
    _check_part(frames, reading.start, ", ".join(paths))
    inputs, buses = {}, set[str]()
    for key, source in mapping.sources.items():
        message, signal = fields[key]
        channel = source.channel or reading.channel
        decoded, bus = reader.signal(message, signal.name, channel, ", ".join(paths))
        buses.add(bus)
        named = replace(source, signal=f"{message.name}.{signal.name}", channel=bus)
        inputs[key] = understood(key, named, decoded)
    samples, notes = recorded_samples(inputs, reading.clock)
    unprotected = sum(counts.frames for name, counts in reader.counts.items() if name not in mapping.protected)
    used = sum(counts.frames for counts in reader.counts.values())
    return Loaded(
        samples, inputs, [*set_back, *notes], recording, sorted(buses), frames, used, reader.counts, unprotected
    )


def _of_table(path: str, reading: Reading) -> Loaded:
    mapping = reading.mapping
    columns = read_table(path, *(() if mapping is None else (mapping.time, mapping.time_unit)))
    mapping = mapping or mapping_by_name(columns, path)
    start = _beginning(columns) + reading.start
    inputs = {}
    for key, source in mapping.sources.items():
        signal = column(columns, source.signal, path).between(start, start + reading.length)
        _check_part(len(signal.time), reading.start, path)
        inputs[key] = understood(key, source, signal)
    samples, notes = recorded_samples(inputs, reading.clock)
    used = [each.signal for each in inputs.values()]
    of_file = notes_of(used)
    rows = max(len(each.signal.time) for each in inputs.values())
    times = {each.time_column: each.time_unit for each in used if each.time_column}
    return Loaded(samples, inputs, [*of_file, *notes], Table([path]), [], rows, 0, times=times)


def all_signals(
    log: str, database: str | None, channel: str | None, time: tuple[str, str] | None, start: float, length: float
) -> list[Signal]:
    """Return every signal of a log or file, in a part of it. Raise LeverError.

    `time` is the column of time of a file, and its unit.
    """
    _check_there(log)
    if is_table(log):
        signals = read_table(log, *(time or ()))
        first = _beginning(signals) + start
        return [each.between(first, first + length) for each in signals]
    if database is None:
        raise LeverError(f"{log}: a log of a bus needs the database of its messages: add --dbc FILE")
    loaded = load_database(database)
    wanted = [(message, each) for message in loaded.messages for each in message.signals]
    reader, recording = BusSignals(loaded, wanted, {}), Recording([log], translated=False)
    _collect(reader, recording, start, length, None)
    signals = [
        reader.signal(message, each.name, channel or bus, log)[0]
        for message in loaded.messages
        for bus in reader.buses(message)[:1]
        if channel is None or channel in reader.buses(message)
        for each in message.signals
    ]
    if not signals:
        raise LeverError(f"{log}: none of its frames is of a message of {database}: is it the database of this bus?")
    return signals


def _check_part(count: int, start: float, where: str) -> None:
    if start > 0.0 and not count:
        raise LeverError(f"{where}: there is nothing from {start:g} s on (--start)")


def _beginning(columns: Sequence[Signal]) -> float:
    """Return the first time of a file [s]."""
    return min((float(each.time[0]) for each in columns if len(each.time)), default=0.0)


def _check_there(path: str) -> None:
    if path != "-" and not Path(path).exists():
        raise LeverError(f"cannot read {path}: no such file")
    if Path(path).is_dir():
        raise LeverError(f"cannot read {path}: it is a folder: name a file in it")


def _collect(
    reader: BusSignals, recording: Recording, start: float, length: float, progress: Progress | None
) -> tuple[int, tuple[str, ...]]:
    """Hand the frames of a part to the reader; return how many there are, and where their clock was set back."""
    frames = 0
    first_us: int | None = None
    clock = RunningClock(1e6 * LATE)
    for recorded in recording.chunks():
        chunk = recorded.copy()
        chunk["time_us"] = clock.running(recorded["time_us"])
        first_us = int(chunk["time_us"][0]) if first_us is None else first_us
        since = (chunk["time_us"] - first_us) * 1e-6
        part = chunk[(since >= (start or -math.inf)) & (since < start + length)]
        frames += len(part)
        reader.add(part, recording)
        if progress is not None:
            progress(recording.done, recording.size)
        if since[-1] > start + length + LATE:
            break
    if reader.fd and first_us is not None:
        first = first_us + round(1e6 * start)
        for path in recording.paths:
            reader.add_fd(path, first, first + round(1e6 * min(length, _EVER)))
    return frames, clock.note(seconds=1e-6)


_EVER = 1e9  # [s]


def column(columns: Sequence[Signal], name: str, where: str) -> Signal:
    """Return a column by its name, or by the part after the last dot. Raise LeverError."""
    for matches in (
        [each for each in columns if each.name == name],
        [each for each in columns if each.name.lower() in (name.lower(), split_name(name)[0].lower())],
        [each for each in columns if each.name.rpartition(".")[2] == name.rpartition(".")[2]],
    ):
        if len(matches) == 1:
            return matches[0]
    names = [each.name for each in columns]
    near = nearest_names(name, names) or names[:8]
    raise LeverError(f"{where}: no column {name}; there are {', '.join(near)}{' …' if len(names) > len(near) else ''}")
