"""`lever record`."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..can.buses import add_bus_options, add_duration_option, check_others_can_be_heard, chosen_options, open_bus
from ..cli.layout import say, warn
from ..cli.tables import Row, Tables, add_json_option
from ..errors import LeverError
from .options import add_signal_options, input_files

if TYPE_CHECKING:
    from ..can.recorder import Recorder
    from ..signals.reading import Reading

_DESCRIPTION = """\
Records everything on a CAN bus, through any interface of python-can, into a log in the format of candump -L, for
`lever replay`, `lever tune`, canplayer and the like. Lost frames are detected by the E2E counters of the messages of
lever.dbc, damaged ones by their CRC. Ctrl-C ends the recording. With --dbc and --map, the recorded signals that are
mapped are shown at the end, with their rates and what is missing.

Until it has ended the log is called FILE.partial. A file that keeps that name is incomplete: the disk was full, or the
bus failed. FILE.provenance.json says by which version it was recorded, when and how, and has the SHA-256 of FILE.
"""
_EPILOG = """\
examples:
  lever record --interface socketcan --channel can0
  lever record --interface socketcan --channel can0 -o flight.log --duration 3600
  lever record --interface slcan --channel /dev/ttyACM0 --bitrate 1000000 -o bench.log
  lever record --interface socketcan --channel can0 --dbc aircraft.dbc --map aircraft.toml -o flight.log

Exit status: 0 when FILE is complete (losses on the bus are reported, but are no error), 2 when the recording failed.
"""


def add_parser(subparsers: argparse._SubParsersAction[Any]) -> None:
    """Add the parser of `lever record`."""
    parser = subparsers.add_parser(
        "record", help="record a CAN bus into a log, with losses counted", description=_DESCRIPTION, epilog=_EPILOG
    )
    add_bus_options(parser)
    parser.add_argument("-o", "--out", metavar="FILE", type=Path, help="the log (default: lever_DATE_TIME.log)")
    add_duration_option(parser, "at Ctrl-C")
    add_signal_options(parser, part=False)
    add_json_option(parser)


def run(args: argparse.Namespace) -> int:
    """Run `lever record`; return the exit status."""
    from ..can.recorder import Recorder
    from ..cli.tables import print_tables
    from ..runtime.files import write_text
    from ..runtime.provenance import provenance

    out = args.out or Path(time.strftime("lever_%Y%m%d_%H%M%S.log"))
    if args.interface is None:
        raise LeverError("no bus given: name one, such as --interface socketcan --channel can0")
    check_others_can_be_heard(args.interface)
    reading, fd = _reading(args)
    options = chosen_options(args, fd=fd)
    with open_bus(args.interface, args.channel, options, translated=False) as bus, _stopping() as stopped:
        recorder = Recorder(bus, out, args.channel or args.interface)
        print(f"recording {bus.channel_info} into {out}; Ctrl-C ends", file=sys.stderr)
        line = _Line()

        def ended() -> bool:
            return bool(stopped) or (args.duration is not None and recorder.elapsed >= args.duration)

        try:
            recorder.run(ended, line.show)
        finally:
            line.end()
    inputs = input_files(args)
    print_tables({"recorded": _rows(recorder), **_mapped(out, reading)}, args.json, inputs=inputs)
    write_text(out.with_name(f"{out.name}.provenance.json"), provenance(inputs).with_outputs([out]).text())
    say(f"{out}: {_summary(recorder)}")
    return 0


def _reading(args: argparse.Namespace) -> tuple[Reading | None, bool]:
    """Return how the log will be read by others, checked before it is recorded, and whether that is CAN FD.

    Raise LeverError.
    """
    if not (args.map or args.dbc or args.clock):
        return None, False
    if not (args.map and args.dbc):
        raise LeverError("mapped signals need both --dbc FILE and --map KEY=MESSAGE.SIGNAL")
    from ..signals.bus_signals import find, load_database, of_fd
    from ..signals.mapping import read_mapping
    from ..signals.reading import Reading

    mapping, database = read_mapping(args.map), load_database(args.dbc)
    messages = [find(database, source.signal, args.dbc)[0] for source in mapping.sources.values()]
    return Reading(mapping, args.dbc, clock=args.clock), any(map(of_fd, messages))


def _mapped(log: Path, reading: Reading | None) -> Tables:
    """Return what has come of the mapped signals. A log without them is complete, too."""
    if reading is None:
        return {}
    from ..signals.reading import read

    try:
        samples = read([log], reading)
    except LeverError as error:
        warn(str(error))
        return {}
    summary = samples.summary()
    messages: list[Row] = [{"message": name, **vars(counts)} for name, counts in summary.messages.items()]
    signals: list[Row] = [{"input": key, **vars(each)} for key, each in summary.inputs.items()]
    return {"signals": signals, "mapped messages": messages}


@contextmanager
def _stopping() -> Iterator[list[int]]:
    """Yield a list that holds the signal once Ctrl-C or SIGTERM has come."""
    came: list[int] = []
    before = {
        number: signal.signal(number, lambda got, _: came.append(got)) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Line:
    """How it goes: one line that is written over on a terminal, a line now and then elsewhere."""

    _BETWEEN_LINES = 30.0  # [s] where standard error is not a terminal

    def __init__(self) -> None:
        self._on_terminal = sys.stderr.isatty()
        self._printed_at = time.monotonic()
        self._last = 0
        self._at = 0.0

    def show(self, recorder: Recorder) -> None:
        rate = (recorder.frames - self._last) / max(recorder.elapsed - self._at, 1e-9)
        self._last, self._at = recorder.frames, recorder.elapsed
        text = f"{recorder.elapsed:.0f} s, {rate:.0f} frames/s, {_summary(recorder)}"
        if self._on_terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
        elif time.monotonic() - self._printed_at >= self._BETWEEN_LINES:
            self._printed_at = time.monotonic()
            print(f"lever: record: {text}", file=sys.stderr)

    def end(self) -> None:
        if self._on_terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _summary(recorder: Recorder) -> str:
    parts = [
        f"{recorder.frames} frames",
        f"{recorder.lost} lost",
        f"{recorder.corrupt} corrupt",
        f"{recorder.error_frames} error frames",
        f"controller {recorder.bus_state}",
    ]
    if recorder.left_active:
        parts.append(f"not active {recorder.left_active} times")
    if recorder.overflows:
        parts.append(f"{recorder.overflows} overflows of the controller")
    return ", ".join(parts)


def _rows(recorder: Recorder) -> list[Row]:
    rows: list[Row] = [
        {
            "message": each.name,
            "id": f"{each.identifier:#05x}",
            "frames": each.frames,
            "rate [1/s]": each.frames / max(recorder.elapsed, 1e-9),
            "lost": each.lost,
            "repeated": each.repeated,
            "corrupt": each.corrupt,
        }
        for each in recorder.messages.values()
        if each.frames
    ]
    rest: Row = {
        "message": "others",
        "id": "",
        "frames": recorder.others,
        "rate [1/s]": recorder.others / recorder.elapsed,
    }
    return [*rows, {**rest, "lost": None, "repeated": None, "corrupt": None}]
