"""Logs in every format against python-can's readers and writers; and what is not a log, or only a part of one."""

from __future__ import annotations

import gzip
import itertools
import os
import subprocess
import sys
import threading
from pathlib import Path

import can
import numpy as np
import pytest
from lever_cdkf.can import bulk, logs
from lever_cdkf.can.logs import Recording
from python.conftest import Refused, Session

LINES = """\
(1436509052.249713) vcan0 044#2A366C2BBA
(1436509052.449847) vcan0 0F6#7ADFE07BD2 R
(1436509052.650004) can1 12345678#0011223344556677 T
(1436509052.850111) vcan0 123#R
(1436509052.850112) vcan0 123#R4
(1436509053.850113) vcan0 20000080#0000000000000000
(0000000001.000001) slcan-7 7FF#
(1.5) x 001#aBcD
"""
FORMATS = ("log", "log.gz", "asc", "asc.gz", "blf", "csv", "mf4", "trc")


def frames_of(*paths: Path) -> bulk.Frames:
    return np.concatenate(list(Recording(paths).chunks()))


def convert(log: Path, into: Path, frames: int = 2000) -> None:
    """Write the first frames of a log in another format, by python-can."""
    with can.LogReader(log) as reader, can.Logger(into) as logger:
        for message in itertools.islice(reader, frames):
            logger.on_message_received(message)


# --- candump's text --------------------------------------------------------------------------------------------------


def test_text_is_read_as_python_can_reads_it(tmp_path: Path) -> None:
    log = tmp_path / "mixed.log"
    log.write_text(LINES)
    recording = Recording([log])
    frames = np.concatenate(list(recording.chunks()))
    with can.CanutilsLogReader(log) as reader:
        messages = list(reader)
    assert len(frames) == len(messages) == len(LINES.splitlines())
    assert recording.damaged == 0
    for frame, message in zip(frames, messages, strict=True):
        assert frame["time_us"] == round(message.timestamp * 1e6)
        assert bool(frame["flags"] & bulk.REMOTE) == message.is_remote_frame
        assert bool(frame["flags"] & bulk.ERROR) == message.is_error_frame
        if not message.is_error_frame:  # of which python-can keeps neither identifier nor data
            assert frame["id"] == message.arbitration_id
            assert recording.buses.names()[frame["bus"]] == str(message.channel)
            assert bool(frame["flags"] & bulk.EXTENDED) == message.is_extended_id
            assert frame["length"] == message.dlc
            assert frame["data"][: len(message.data)].tobytes() == bytes(message.data)


@pytest.mark.parametrize(
    "line",
    [
        "nonsense",
        "(1.0) can0 123",
        "(1.0) can0 #00",
        "(1.0) can0 1234#00",
        "(1.0) can0 123#0",
        "(1.0) can0 123#001122334455667788",
        "(1.0) can0 FFF#00",
        "(1.0) can0 G23#00",
        "(1.0) 123#00",
        "(1.0) " + "x" * 40 + " 123#00",
        "(x.0) can0 123#00",
        "(1) can0 123#00",
        "(1.0 can0 123#00",
        "(123456789012345.0) can0 123#00",
        "(1.0) can0 123#00 X",
        "(1.0) can0 123#R9",
        "\x00\xff\xfe",
    ],
)
@pytest.mark.requirement("S11")
def test_a_line_that_is_no_frame_is_counted(line: str, tmp_path: Path) -> None:
    log = tmp_path / "damaged.log"
    log.write_bytes(f"(1.0) can0 123#00\n{line}\n\n(2.0) can0 124#00\n".encode("latin-1"))
    recording = Recording([log])
    assert [frame["id"] for chunk in recording.chunks() for frame in chunk] == [0x123, 0x124]
    assert recording.damaged == 1
    assert recording.ends_early == []


def test_a_last_line_without_its_end_counts(tmp_path: Path) -> None:
    log = tmp_path / "cut.log"
    log.write_text("(1.0) can0 123#00\n(2.0) can0 124#00")
    recording = Recording([log])
    assert [frame["id"] for chunk in recording.chunks() for frame in chunk] == [0x123, 0x124]
    assert (recording.damaged, recording.ends_early) == (0, [f"{log}: its last line has no end"])


@pytest.mark.parametrize("block", [7, 64, 1000])
def test_where_blocks_are_cut_makes_no_difference(
    block: int, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = tmp_path / "part.log"
    log.write_text("".join(f"{line}\n" for line in session.lines[:300]) + "x" * 3000 + "\n(9.0) lever 123#00\n")
    whole = frames_of(log)
    monkeypatch.setattr(logs, "BLOCK", block)
    recording = Recording([log])
    assert np.array_equal(np.concatenate(list(recording.chunks())), whole)
    assert len(whole) == 301
    assert recording.damaged == 1


# --- other formats ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_the_same_frames(
    suffix: str, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logs, "_MESSAGES", 700)
    expected = frames_of(session.log)[:2000]
    path = tmp_path / f"session.{suffix}"
    convert(session.log, path)
    recording = Recording([path])
    frames = np.concatenate(list(recording.chunks()))
    assert len(frames) == 2000
    assert [bool(name) for name in recording.buses.names()] == [True]  # TRC and ASC number the bus
    for field in ("id", "length", "flags", "data"):
        assert np.array_equal(frames[field], expected[field]), field
    apart = frames["time_us"] - expected["time_us"]
    assert np.ptp(apart) <= 200  # TRC has steps of 0.1 ms


def test_several_logs_are_taken_in_the_order_of_time(session: Session, tmp_path: Path) -> None:
    lines = session.log.read_bytes().splitlines(keepends=True)
    first, second, third = (tmp_path / name for name in ("c.log", "a.log.gz", "b.log"))
    first.write_bytes(b"".join(lines[:5000]))
    second.write_bytes(gzip.compress(b"".join(lines[5000:9000])))
    third.write_bytes(b"".join(lines[9000:]))
    assert np.array_equal(frames_of(third, first, second), frames_of(session.log))


def test_standard_input_is_a_log(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    with session.log.open() as log:
        monkeypatch.setattr(sys, "stdin", log)
        recording = Recording(["-"])
        assert np.array_equal(np.concatenate(list(recording.chunks())), frames_of(session.log))
    assert recording.done == recording.size == 0  # which nobody knows


# --- what is no log --------------------------------------------------------------------------------------------------


GARBAGE = np.random.default_rng(0).bytes(200_000)


@pytest.mark.parametrize("suffix", ["log", "log.gz", "asc", "blf", "csv", "mf4", "trc", "db"])
@pytest.mark.parametrize("content", [b"", GARBAGE], ids=["empty", "garbage"])
@pytest.mark.requirement("S11")
def test_what_is_no_log_is_one_line(content: bytes, suffix: str, tmp_path: Path, refused: Refused) -> None:
    path = tmp_path / f"bad.{suffix}"
    path.write_bytes(content)
    assert "bad." in refused("replay", path)


def test_other_failures_are_one_line_each(tmp_path: Path, refused: Refused) -> None:
    assert "No such file" in refused("replay", tmp_path / "absent.log")
    assert "it is a folder" in refused("replay", tmp_path)
    (tmp_path / "a.xyz").touch()
    assert ".xyz is not a known format" in refused("replay", tmp_path / "a.xyz")
    foreign = tmp_path / "foreign.log"
    foreign.write_text("(1.0) can0 123#00\n(1.1) can1 124#00\n")
    error = refused("replay", foreign)
    assert "no sample" in error
    assert "can0, can1" in error
    assert f"{foreign}: given twice" in refused("replay", foreign, tmp_path / "." / "foreign.log")


@pytest.mark.requires("setpriv")
def test_without_permission_it_says_so(session: Session, tmp_path: Path) -> None:
    secret = tmp_path / "secret.log"
    secret.write_bytes(session.log.read_bytes())
    secret.chmod(0)
    program = f"{QUICKLY}from lever_cdkf.can.logs import Recording\nRecording([{str(secret)!r}])\n"
    command = [sys.executable, "-c", program]
    if os.geteuid() == 0:
        tmp_path.chmod(0o755)
        command = ["setpriv", "--bounding-set=-dac_override,-dac_read_search", "--inh-caps=-all", *command]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr.splitlines()[-1].endswith(f"LogError: cannot read {secret}: Permission denied")


@pytest.mark.parametrize("suffix", ["log", "log.gz", "csv"])
def test_a_log_that_breaks_off_gives_what_it_has(suffix: str, session: Session, tmp_path: Path) -> None:
    whole, cut = tmp_path / f"whole.{suffix}", tmp_path / f"cut.{suffix}"
    convert(session.log, whole)
    content = whole.read_bytes()
    cut.write_bytes(content[: len(content) // 2 - 3])
    recording = Recording([cut])
    frames = np.concatenate(list(recording.chunks()))
    assert 0 < len(frames) < 2000
    assert np.array_equal(frames["data"], frames_of(session.log)["data"][: len(frames)])
    assert len(recording.ends_early) == 1
    assert "cut." in recording.ends_early[0]


# --- without end -----------------------------------------------------------------------------------------------------

STREAM_MB = 20
QUICKLY = "import sys; sys.modules['asammdf'] = None\n"
"""Python-can loads it where it can, which takes longer than all else."""
COUNTING = (
    QUICKLY
    + """
import resource
from lever_cdkf.can.logs import Recording
from lever_cdkf.can.estimator_frames import EstimatorFrames
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
traffic = EstimatorFrames(Recording([sys.argv[1]]))
ours = sum(len(frames) for frames in traffic.chunks())
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(ours, traffic.frames, sum(traffic.others.values()), (after - before) // 1024)
"""
)


@pytest.mark.requirement("S11")
def test_foreign_frames_without_end_take_no_memory(session: Session, tmp_path: Path) -> None:
    """Through a named pipe: what is read cannot be kept anywhere but in memory."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    foreign = b"".join(b"(1436509052.%06d) can%d %03X#1122334455667788\n" % (i, i % 2, i % 0x100) for i in range(20000))
    times = STREAM_MB * 1_000_000 // len(foreign)

    def write() -> None:
        with pipe.open("wb") as file:
            for _ in range(times):
                file.write(foreign)
            file.write(session.log.read_bytes())
            for _ in range(times):
                file.write(foreign)

    writer = threading.Thread(target=write)
    writer.start()
    done = subprocess.run([sys.executable, "-c", COUNTING, str(pipe)], capture_output=True, text=True, check=False)
    writer.join()
    assert done.returncode == 0, done.stderr
    ours, frames, others, megabytes = map(int, done.stdout.split())
    assert ours == len(session.lines)
    assert others == 2 * times * 20000
    assert frames == ours + others
    assert megabytes < STREAM_MB


# --- lines without end ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [bulk.LONGEST_LINE, bulk.LONGEST_LINE + 1, 5 * bulk.LONGEST_LINE])
def test_a_line_that_is_too_long_is_one_line(length: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is so for blocks of any size, and the lines after it are read."""
    log = tmp_path / "long.log"
    log.write_text("(1.0) can0 123#00\n" + "x" * length + "\n(2.0) can0 124#00\n")
    for block in (bulk.LONGEST_LINE // 2, bulk.LONGEST_LINE, 1 << 20):
        monkeypatch.setattr(logs, "BLOCK", block)
        recording = Recording([log])
        assert [frame["id"] for chunk in recording.chunks() for frame in chunk] == [0x123, 0x124]
        assert (recording.damaged, recording.ends_early) == (1, [])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("once\nupon\n", "holds no CAN frame; 2 lines of it are something else: is it a log of candump -L?"),
        ("", "holds no CAN frame"),
    ],
)
def test_a_log_without_a_frame_says_what_it_holds(content: str, said: str, tmp_path: Path) -> None:
    log = tmp_path / "none.log"
    log.write_text(content)
    with pytest.raises(logs.LogError) as error:
        Recording([log])
    assert str(error.value) == f"{log}: {said}"


def test_bytes_that_are_done_are_counted(session: Session, tmp_path: Path) -> None:
    packed = tmp_path / "b.log.gz"
    packed.write_bytes(gzip.compress(b"(1.0) can0 123#00\n" * 100))
    for paths in ([session.log], [packed], [session.log, packed]):
        recording = Recording(paths)
        size = sum(path.stat().st_size for path in paths)
        assert recording.size == size
        assert 0 < recording.done <= size
        assert sum(map(len, recording.chunks())) > 0
        assert recording.done == size


def test_what_is_said_of_logs_that_are_cut_off() -> None:
    assert logs.incomplete([]) == ""
    assert logs.incomplete(["a: x", "b: y"]) == "The log is incomplete: a: x; b: y."
