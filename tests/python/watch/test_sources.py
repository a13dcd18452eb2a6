"""Sources: frames come as they came on the bus or in the log, and the bus does not notice who watches."""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import can
import pytest
from lever_cdkf.can import codec
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.watch import sources
from lever_cdkf.watch.picture import ERROR, FOREIGN, Frame, Picture
from lever_cdkf.watch.sources import BusSource, LogSource, Source
from lever_cdkf.watch.transfer import FREQUENCIES
from lever_sil.run.live_source import SimulationSource
from lever_sil.scenarios.scenario import load
from processes import PATIENCE
from python.conftest import Run
from python.watch.conftest import Flight


def wait_for(source: Source, count: int) -> list[Frame]:
    """Return the frames of a source until there are `count`."""
    frames: list[Frame] = []
    deadline = time.monotonic() + PATIENCE
    while len(frames) < count:
        assert time.monotonic() < deadline, f"{len(frames)} of {count} frames; {source.error}"
        frames += source.drain()
        time.sleep(0.01)
    return frames


@pytest.fixture
def other_end() -> Iterator[can.BusABC]:
    """Yield another one on the virtual bus `watched`."""
    with can.Bus(interface="virtual", channel="watched") as bus:
        yield bus


@pytest.fixture
def on_bus(other_end: can.BusABC) -> Iterator[BusSource]:
    source = BusSource("virtual", "watched")
    source.start()
    yield source
    source.stop()


# --- a bus -----------------------------------------------------------------------------------------------------------


def test_takes_what_passes_and_sends_nothing(other_end: can.BusABC, on_bus: BusSource, flight: Flight) -> None:
    sent = flight.messages(50)
    for message in sent:
        other_end.send(message)
    frames = wait_for(on_bus, len(sent))
    assert [(identifier, bytes(data)) for identifier, data in frames] == [
        (message.arbitration_id, bytes(message.data)) for message in sent
    ]
    assert other_end.recv(0.1) is None


def test_what_is_no_classic_data_frame_is_marked(other_end: can.BusABC, on_bus: BusSource) -> None:
    other_end.send(can.Message(arbitration_id=0x210, is_extended_id=True, data=bytes(8)))
    other_end.send(can.Message(arbitration_id=0x210, is_extended_id=False, is_remote_frame=True, dlc=8))
    other_end.send(can.Message(arbitration_id=0x210, is_extended_id=False, is_fd=True, data=bytes(12)))
    other_end.send(can.Message(is_error_frame=True))
    assert [identifier for identifier, _ in wait_for(on_bus, 4)] == [FOREIGN, FOREIGN, FOREIGN, ERROR]


def test_a_view_that_never_looks_neither_slows_the_bus_nor_fills_memory(
    other_end: can.BusABC, on_bus: BusSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "MOST_WAITING", 1000)
    on_bus._waiting = type(on_bus._waiting)(maxlen=1000)
    message = can.Message(arbitration_id=0x210, is_extended_id=False, data=bytes(8))
    begin = time.monotonic()
    for _ in range(8000):  # a second of a full bus
        other_end.send(message)
    while on_bus.dropped < 7000:
        assert time.monotonic() - begin < PATIENCE
        time.sleep(0.01)
    assert len(on_bus.drain()) == 1000
    assert on_bus.dropped == 7000


def test_a_bus_that_breaks_is_an_error_in_one_line(on_bus: BusSource, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_timeout: float) -> can.Message | None:
        raise can.CanOperationError("Network is down\n[Errno 100]")

    monkeypatch.setattr(on_bus._bus, "recv", broken)
    other = BusSource("virtual", "watched")
    monkeypatch.setattr(other._bus, "recv", broken)
    other.start()
    other._thread.join(PATIENCE)
    assert (other.ended, other.error) == (True, "Network is down [Errno 100]")
    other.stop()


def test_an_interface_that_lacks_a_package_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "msgpack", None)
    with pytest.raises(LeverError) as caught:
        BusSource("udp_multicast", "239.74.163.2")
    install = f'{sys.executable} -m pip install "msgpack"'
    assert str(caught.value) == f"interface udp_multicast needs the Python package msgpack: {install}"


def test_a_command_goes_out_protected_and_is_shown(other_end: can.BusABC, on_bus: BusSource) -> None:
    on_bus.command({"request": "freeze"})
    on_bus.command({"dither_rms": 0.3})
    received = [other_end.recv(PATIENCE), other_end.recv(PATIENCE)]
    decoded = [codec.decode(message.arbitration_id, message.data)[1] for message in received if message is not None]
    assert [values["counter"] for values in decoded] == [0, 1]
    assert [values["request"] for values in decoded] == [2, 2]  # goes with it until it is acknowledged
    assert [values["dither_rms"] for values in decoded] == [65.535, pytest.approx(0.3)]  # the first keeps it
    assert all(values[what] == 15 for values in decoded for what in CHOICES)
    assert [identifier for identifier, _ in on_bus.drain()] == [0x120, 0x120]


class Commanding(Source):
    """Notes the counter, request and dither of what it sends."""

    title = "a bus"
    takes_commands = True

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[tuple[float, float]] = []
        self.dithers: list[float] = []

    def run(self) -> None:
        raise NotImplementedError

    def _transmit(self, identifier: int, data: bytes) -> None:
        values = codec.decode(identifier, data)[1]
        self.sent.append((values["counter"], values["request"]))
        self.dithers.append(values["dither_rms"])


@pytest.fixture
def pass_time(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Let time pass for sources [s]."""
    now = [1000.0]
    monkeypatch.setattr(sources, "time", SimpleNamespace(monotonic=lambda: now[0]))

    def pass_by(seconds: float) -> None:
        now[0] += seconds

    return pass_by


FREEZE = 2


def test_a_command_is_repeated_until_it_is_acknowledged_in_sequence(pass_time: Callable[[float], None]) -> None:
    source = Commanding()
    source.command({"request": "freeze"})
    accepted, sequence = 0, 2
    for counter, result, sent in ((7, accepted, 2), (1, sequence, 3), (2, accepted, 3)):
        source.acknowledged({"command_counter": counter, "result": result})
        pass_time(0.1)
        source.keep_alive()
        pass_time(0.2)
        source.keep_alive()
        assert source.sent == [(k, FREEZE) for k in range(sent)]
    assert not source.refusals


def test_dither_is_kept_alive_only_once_it_is_accepted(pass_time: Callable[[float], None]) -> None:
    """An answer to any try of it will do; until there is one, what was asked before goes with it."""
    source = Commanding()
    accepted, acting, keep = 0, 5, 65.535
    source.command({"request": "freeze"})
    source.command({"dither_rms": 0.3})
    pass_time(0.3)
    source.keep_alive()
    source.acknowledged({"command_counter": 1, "result": accepted})
    pass_time(0.3)
    source.keep_alive()
    assert source.sent == [(0, FREEZE), (1, FREEZE), (2, FREEZE), (3, 0)]
    assert source.dithers == [keep, 0.3, 0.3, keep]
    source.end_dither()
    source.acknowledged({"command_counter": 4, "result": accepted})
    source.command({"dither_rms": 0.3})
    source.acknowledged({"command_counter": 5, "result": acting})
    pass_time(0.3)
    source.keep_alive()
    assert source.dithers[4:] == [0.0, 0.3]


@pytest.mark.parametrize(("result", "why"), [(None, "no COMMAND_ACK"), (2, "is there another sender of COMMAND?")])
def test_a_command_that_nobody_obeys_is_told_after_a_second(
    result: int | None, why: str, pass_time: Callable[[float], None]
) -> None:
    source = Commanding()
    source.command({"request": "freeze"})
    for _ in range(20):
        if result is not None:
            source.acknowledged({"command_counter": source.sent[-1][0], "result": result})
        pass_time(0.3)
        source.keep_alive()
    assert source.sent == [(counter, FREEZE) for counter in range(5)]
    assert why in source.refusals[0]


@pytest.mark.parametrize(("result", "why"), [(4, "LEVER_COMMANDS=ON"), (5, "acts on the lever"), (6, "not safe now")])
def test_a_command_that_is_refused_for_good_is_told_and_not_repeated(
    result: int, why: str, pass_time: Callable[[float], None]
) -> None:
    source = Commanding()
    source.command({"request": "freeze"})
    source.acknowledged({"command_counter": 0, "result": result})
    pass_time(1.0)
    source.keep_alive()
    assert len(source.sent) == 1
    (told,) = source.refusals
    assert why in told


# --- a log -----------------------------------------------------------------------------------------------------------


def test_a_log_is_played_at_its_pace(log: Path, flight: Flight) -> None:
    source = LogSource(str(log))
    begin = time.monotonic()
    source.start()
    while not source.ended:
        assert time.monotonic() - begin < PATIENCE
        time.sleep(0.01)
    assert time.monotonic() - begin >= 0.59
    source.stop()
    assert source.error is None
    frames, picture = source.drain(), Picture()
    with can.LogReader(log) as reader:
        assert [(identifier, bytes(data)) for identifier, data in frames] == [
            (message.arbitration_id, bytes(message.data)) for message in reader
        ]
    picture.take(frames, 0.6)
    assert picture.parameters()[0].value == pytest.approx(flight.bus.estimator.estimate().parameter[0], rel=0.01)


def test_the_interpreter_is_left_as_it_was(log: Path) -> None:
    """Threads take turns more often while a source runs; also when it has ended by itself before it is stopped."""
    before = sys.getswitchinterval()
    source = LogSource(str(log))
    source.start()
    assert sys.getswitchinterval() == pytest.approx(0.1 * before)
    source._thread.join(PATIENCE)
    assert source.ended
    for _ in range(2):
        source.stop()
        assert sys.getswitchinterval() == before


def test_a_log_is_read_at_once_with_the_same_result(log: Path) -> None:
    picture, whole = Picture(), Picture()
    LogSource(str(log)).read_into(picture)
    assert picture.now == pytest.approx(0.599)
    assert picture.traffic["STATE_ESTIMATE"].rate == pytest.approx(1000, rel=0.02)
    with can.LogReader(log) as reader:
        whole.take([(message.arbitration_id, message.data) for message in reader], 0.6)
    assert [entry[:3] for entry in picture.parameters()] == [entry[:3] for entry in whole.parameters()]


def test_one_channel_of_a_log(log: Path) -> None:
    log.write_text(log.read_text() + "(0.700000) can1 123#00 R\n")
    picture = Picture()
    LogSource(str(log), "can1").read_into(picture)
    assert (picture.foreign, picture.traffic["STATE_ESTIMATE"].frames) == (1, 0)
    with pytest.raises(LeverError, match="no CAN frame of channel can7 in it"):
        LogSource(str(log), "can7").read_into(picture)


def test_a_clock_that_jumps_is_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "jumps.log"
    times = (100.0, 100.1, 50.0, 50.1, 1e9, 1e9 + 0.1)
    path.write_text("".join(f"({when:.6f}) can0 123#00 R\n" for when in times))
    pauses = [pause for pause, _ in LogSource(str(path))._frames()]
    assert pauses == pytest.approx([0.0, 0.1, 0.0, 0.1, 5.0, 0.1], abs=1e-6)


def test_a_part_of_a_log(log: Path) -> None:
    whole = list(LogSource(str(log))._frames())
    span = sum(pause for pause, _ in whole)
    frames = [frame for _, frame in LogSource(str(log), part=(0.25 * span, 0.5 * span))._frames()]
    first = next(k for k in range(len(whole)) if sum(pause for pause, _ in whole[: k + 1]) >= 0.25 * span)
    assert frames == [frame for _, frame in whole[first : first + len(frames)]]
    assert 0.4 * len(whole) < len(frames) < 0.6 * len(whole)
    with pytest.raises(LeverError, match="no CAN frame in the part from --start on"):
        list(LogSource(str(log), part=(100.0, math.inf))._frames())


def test_a_log_that_breaks_off_is_shown_as_far_as_it_goes(tmp_path: Path) -> None:
    (tmp_path / "truncated.log").write_text("(1.000000) can0 123#00 R\n(1.1")
    source, picture = LogSource(str(tmp_path / "truncated.log")), Picture()
    source.read_into(picture)
    assert picture.foreign == 1
    assert source.error is None
    assert source.warning is not None
    assert source.warning.endswith("truncated.log: its last line has no end.")


def test_that_a_log_breaks_off_is_said_once_beside_what_was_guessed(tmp_path: Path) -> None:
    log = tmp_path / "cut.log"
    log.write_text("(1.000000) can0 123#00 R\n(1.1")
    whole = f"Guessed: degrees. The log is incomplete: {log}: its last line has no end."
    for said in ("Guessed: degrees.", whole):
        source = LogSource(str(log))
        source.warning = said
        source.read_into(Picture())
        assert source.warning == whole


def test_a_log_that_breaks_off_while_a_page_shows_it_is_warned_of(tmp_path: Path, lever: Run) -> None:
    log = tmp_path / "cut.log"
    log.write_text("(1.000000) can0 123#00 R\n(1.1")
    status, out, err = lever("live", log, "--port", "0", "--duration", "0.3")
    assert status == 0
    assert re.fullmatch(rf"{log}: open http://127\.0\.0\.1:\d+/ \(Ctrl-C ends\)\n", out)
    assert err == f"lever: warning: The log is incomplete: {log}: its last line has no end.\n"


# --- a simulation ----------------------------------------------------------------------------------------------------


def test_a_simulation_runs_in_real_time_and_obeys() -> None:
    source, picture = SimulationSource(load("steady", [f"duration={PATIENCE} s"])), Picture()
    assert source.truth(FREQUENCIES) is None, "it has not begun"
    source.start()
    try:
        while picture.mode != "run" or picture.traffic["STATE_ESTIMATE"].frames < 2000:
            assert source.now < PATIENCE
            time.sleep(0.1)
            picture.take(source.drain(), source.now)
        assert source.now > 1.9  # 2000 samples in real time
        assert not math.isnan(picture.parameters()[0].value)
        truth = source.truth(FREQUENCIES)
        assert truth is not None
        assert set(truth[0]) >= {"m_p", "c_p", "k_p", "natural_frequency", "damping_ratio"}
        source.command({"request": "freeze"})
        while picture.mode != "frozen":
            assert source.now < PATIENCE
            time.sleep(0.1)
            picture.take(source.drain(), source.now)
        assert picture.traffic["COMMAND"].corrupt == 0
    finally:
        source.stop()
    assert not source._thread.is_alive()
