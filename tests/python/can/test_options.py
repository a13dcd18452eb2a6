"""Buses from a command line, frames that are not the estimator's, and the words for what was refused or left out."""

from __future__ import annotations

import argparse
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import can
import pytest
from can.interfaces import BACKENDS
from lever_cdkf.can import buses, codec, identifiers
from lever_cdkf.can.buses import add_bus_options, add_duration_option, chosen_options, make_room, open_bus
from lever_cdkf.can.commander import KEEP, Commander, refusal, result_of
from lever_cdkf.can.estimator_frames import EstimatorFrames, why_refused
from lever_cdkf.can.identifiers import Identifiers, from_bus, to_bus, word
from lever_cdkf.can.logs import LogError, Recording
from lever_cdkf.can.message_counts import MessageCounter
from lever_cdkf.can.recorder import Recorder
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import CHOICES
from python.conftest import Session


class Spy(can.BusABC):
    """A bus that keeps what it was opened with, and sends nothing."""

    opened: ClassVar[list[dict[str, Any]]] = []

    def __init__(self, channel: str = "none", **kwargs: Any) -> None:
        super().__init__(channel)
        if kwargs.get("broken"):
            raise NameError("no driver")
        self.opened.append({"channel": channel, **kwargs})
        self.sent: list[can.Message] = []
        self.coming: list[can.Message] = []
        if "info" in kwargs:
            self.channel_info = kwargs["info"]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self.coming.pop(0) if self.coming else None


@pytest.fixture(autouse=True)
def _spy(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Spy is the bus of interfaces that no test has a use for; and the identifiers are put back."""
    for name in ("kvaser", "slcan"):
        monkeypatch.setitem(BACKENDS, name, (__name__, Spy.__name__))
    Spy.opened.clear()
    yield
    identifiers.use(argparse.Namespace())


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_bus_options(parser)
    add_duration_option(parser, "never")
    return parser.parse_args(arguments)


# --- from a command line ---------------------------------------------------------------------------------------------


def test_options_of_a_bus_are_numbers_truths_or_words() -> None:
    words = ("--bus-option", "a=1", "--bus-option", "b=0.5", "--bus-option", "c=true", "--bus-option", "d=x=y")
    assert chosen_options(parsed(*words)) == {"a": 1, "b": 0.5, "c": True, "d": "x=y"}
    assert chosen_options(parsed()) == {}
    assert chosen_options(parsed("--bus-option", "bitrate=1", "--bitrate", "250000")) == {"bitrate": 250_000}


@pytest.mark.parametrize("wrong", ["x", "=1", ""])
def test_an_option_without_key_or_value(wrong: str) -> None:
    with pytest.raises(LeverError) as error:
        chosen_options(parsed("--bus-option", wrong))
    assert str(error.value) == f"--bus-option {wrong}: must be KEY=VALUE, such as tty_baudrate=921600"


def test_can_fd_is_asked_for_where_it_takes_no_more() -> None:
    assert chosen_options(parsed("--interface", "socketcan"), fd=True) == {"fd": True}
    assert chosen_options(parsed("--interface", "pcan"), fd=True) == {}
    assert chosen_options(parsed("--interface", "socketcan")) == {}


@pytest.mark.parametrize("wrong", ["0", "-1", "1e9", "nan", "soon"])
def test_a_duration_is_a_number_of_seconds(wrong: str) -> None:
    assert parsed("--duration", "2.5").duration == 2.5
    assert parsed().duration is None
    with pytest.raises(argparse.ArgumentError, match="is not a number of seconds above 0"):
        parsed("--duration", wrong)


@pytest.mark.parametrize("interface", ["lever", "virtual"])
def test_an_interface_of_one_process_hears_nobody(interface: str) -> None:
    buses.check_others_can_be_heard("socketcan")
    with pytest.raises(LeverError, match=f"^interface {interface} stays inside one process"):
        buses.check_others_can_be_heard(interface)


def test_a_bus_is_opened_with_what_was_asked() -> None:
    open_bus("kvaser", "a", {"bitrate": 500_000}).shutdown()
    open_bus("kvaser", None, {}).shutdown()
    assert Spy.opened == [{"channel": "a", "bitrate": 500_000}, {"channel": "none"}]


def test_an_slcan_adapter_has_the_bit_rate_of_the_contract() -> None:
    open_bus("slcan", "/dev/ttyX", {}).shutdown()
    open_bus("slcan", "/dev/ttyX", {"bitrate": 125_000, "sleep_after_open": 2.0}).shutdown()
    usual, asked = Spy.opened
    assert (usual["bitrate"], usual["sleep_after_open"]) == (1_000_000, 0.0)
    assert (asked["bitrate"], asked["sleep_after_open"]) == (125_000, 2.0)
    assert usual["channel"].endswith("/dev/ttyX")


def test_a_bus_says_what_it_is() -> None:
    with open_bus("kvaser", "7", {}) as bus, open_bus("kvaser", None, {}) as other:
        assert (bus.channel_info, other.channel_info) == ("kvaser channel 7", "kvaser")
    with open_bus("kvaser", "7", {"info": "a bus"}) as bus:
        assert bus.channel_info == "a bus"


def test_what_cannot_be_opened_is_one_line() -> None:
    with pytest.raises(LeverError, match=r"^cannot open kvaser channel 7: no driver; is it there and up"):
        open_bus("kvaser", "7", {"broken": True})
    with pytest.raises(LeverError, match=r"^cannot open kvaser: no driver; is it there and up"):
        open_bus("kvaser", None, {"broken": True})
    with pytest.raises(LeverError, match=r"^no interface 'xyzzy'; there are .*socketcan"):
        open_bus("xyzzy", None, {})


def test_a_socket_gets_room_for_frames_that_wait() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened, Spy() as bus:
        make_room(bus)  # it has no socket
        before = opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        vars(bus)["socket"] = opened
        make_room(bus)
        assert opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= before


# --- identifiers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "chosen", "on_bus", "as_word"),
    [
        ((), Identifiers(), (0x110, False), 0x110),
        (("--id-offset", "0x40"), Identifiers(0x40), (0x150, False), 0x150),
        (("--id-offset", "0"), Identifiers(), (0x110, False), 0x110),
        (("--id-base", "0x18FF0000"), Identifiers(0x18FF0000, True), (0x18FF0110, True), 0x98FF0110),
        (("--id-base", "0"), Identifiers(0, True), (0x110, True), 0x80000110),
    ],
)
def test_identifiers_on_the_bus(
    arguments: tuple[str, ...], chosen: Identifiers, on_bus: tuple[int, bool], as_word: int
) -> None:
    identifiers.use(parsed(*arguments))
    assert identifiers.chosen() == chosen
    assert chosen.are_those_of_the_dbc is (chosen == Identifiers())
    assert to_bus(0x110) == on_bus
    assert from_bus(*on_bus) == (0x110, False)
    assert word(0x110) == as_word
    foreign, extended = from_bus(0x110, not on_bus[1])
    assert extended
    assert foreign in (0x110, 0x110 | 1 << 28)


@pytest.mark.parametrize("wrong", [("--id-offset", "-1"), ("--id-offset", "0x700"), ("--id-base", "0x1FFFFFFF")])
def test_identifiers_that_would_not_fit(wrong: tuple[str, str]) -> None:
    with pytest.raises(argparse.ArgumentError, match=r"must be a number from 0 to 0x[0-9a-f]+, such as 0x40"):
        parsed(*wrong)
    highest = max(message.frame_id for message in codec.database().messages)
    assert parsed("--id-offset", str(0x7FF - highest)).id_offset == 0x7FF - highest


def test_a_shifted_bus_gives_and_takes_those_of_the_dbc() -> None:
    identifiers.use(parsed("--id-offset", "0x40"))
    with open_bus("kvaser", "0", {}) as bus:
        assert isinstance(bus, Spy)
        bus.send(can.Message(arbitration_id=0x120, is_extended_id=False, data=b"12345678"))
        (sent,) = bus.sent
        assert (sent.arbitration_id, sent.is_extended_id, bytes(sent.data)) == (0x160, False, b"12345678")
        error = can.Message(is_error_frame=True, arbitration_id=4)
        bus.coming = [can.Message(arbitration_id=0x150, is_extended_id=False), error]
        assert [message.arbitration_id for message in iter(lambda: bus.recv(0.0), None)] == [0x110, 4]
        assert bus.recv() is None
    plain = open_bus("kvaser", "0", {}, translated=False)
    assert isinstance(plain, Spy)
    plain.send(can.Message(arbitration_id=0x120, is_extended_id=False))
    assert plain.sent[0].arbitration_id == 0x120


# --- commands --------------------------------------------------------------------------------------------------------


def test_a_command_changes_what_it_says_and_counts_to_sixteen() -> None:
    sent: list[tuple[int, bytes]] = []
    commander = Commander()
    counters = [commander.send({"dither_rms": 0.25}, lambda *frame: sent.append(frame)) for _ in range(18)]
    assert counters == [*range(16), 0, 1]
    message = codec.message("COMMAND")
    decoded: Any = message.decode(sent[17][1])
    assert sent[17][0] == message.frame_id
    assert str(decoded["request"]) == "none"
    assert {str(decoded[what]) for what in CHOICES} == {"keep"}
    assert decoded["dither_rms"] == pytest.approx(0.25)
    assert decoded["counter"] == 1
    commander.send({"model": "hand"}, lambda *frame: sent.append(frame))
    decoded = message.decode(sent[18][1])
    assert str(decoded["model"]) == "hand"
    assert decoded["dither_rms"] == pytest.approx(65.535)  # which keeps it


@pytest.mark.parametrize("result", sorted(codec.choices("COMMAND_ACK", "result").items()))
def test_each_result_of_a_command_has_its_words(result: tuple[int, str]) -> None:
    number, name = result
    assert result_of({"result": float(number)}) == name
    said = refusal(name)
    assert said.startswith("the estimator refuses COMMAND: ")
    assert (name == "accepted") is said.endswith(": accepted")
    assert result_of({"result": 14.0}) == "result 14"
    assert refusal("result 14") == "the estimator refuses COMMAND: result 14"


# --- what is not the estimator's -------------------------------------------------------------------------------------


def test_why_frames_are_refused_in_words() -> None:
    assert why_refused(0, 0) == ""
    assert why_refused(1234, 0) == "1,234 corrupt (CRC, length or value)"
    late = "5,678 repeated or out of sequence (does the sender count each message from 0 to 15?)"
    assert why_refused(0, 5678) == late
    assert why_refused(1, 5678) == f"1 corrupt (CRC, length or value), {late}"


def test_each_kind_of_other_frame_is_counted(session: Session, tmp_path: Path) -> None:
    log = tmp_path / "mixed.log"
    others = [
        *["(0.0) can7 700#01"] * 2, *["(0.0) lever 700#01"] * 3, *["(0.0) lever 18FEF100#01"] * 4,
        *["(0.0) lever 110#R"] * 5, *["(0.0) lever 20000004#0004000000000000"] * 6, *["(0.0) lever 110##0112233"] * 7,
    ]  # fmt: skip
    log.write_text("".join(f"{line}\n" for line in [*session.lines[:50], *others]))
    traffic = EstimatorFrames(Recording([log]))
    assert sum(map(len, traffic.chunks())) == 50
    assert traffic.channel == "lever"
    fd = traffic.others["fd"]
    assert traffic.others == {
        "other_buses": 2, "other_identifiers": 3, "extended": 4, "remote": 5, "error": 6, "fd": fd,
    }  # fmt: skip
    assert fd + traffic.recording.damaged == 7


def test_two_buses_with_samples_are_to_be_chosen_of(session: Session, tmp_path: Path) -> None:
    log = tmp_path / "two.log"
    log.write_text("".join(f"{line}\n{line.replace(' lever ', ' can9 ')}\n" for line in session.lines[:50]))
    with pytest.raises(LogError, match=r"two\.log: several buses carry samples: choose with --channel: lever, can9$"):
        list(EstimatorFrames(Recording([log])).chunks())
    traffic = EstimatorFrames(Recording([log]), "can9")
    assert sum(map(len, traffic.chunks())) == 50
    assert traffic.other_samples == {"lever"}
    with pytest.raises(
        LogError, match=r"100 frames, but no sample \(0x111 BASE_SAMPLE\) on bus x in them; its buses: "
    ):
        list(EstimatorFrames(Recording([log]), "x").chunks())


# --- counts ----------------------------------------------------------------------------------------------------------


def test_counts_of_a_message() -> None:
    counter = MessageCounter("LEVER_SAMPLE")
    frames = [codec.encoder("LEVER_SAMPLE")(k, 0.1, 0.2, 0.3) for k in range(16)]
    bad = bytes([frames[5][0] ^ 1]) + frames[5][1:]
    good = counter.take([frames[k] for k in (14, 15, 0, 3, 3)] + [bad] + [frames[6]], 2.5)
    assert good == [frames[k] for k in (14, 15, 0, 3, 3, 6)]
    assert (counter.frames, counter.lost, counter.corrupt, counter.repeated) == (7, 3, 1, 1)
    assert (counter.heard, counter.identifier, counter.sender) == (2.5, 0x110, "INCEPTOR")
    counter.clear()
    assert (counter.frames, counter.lost, counter.corrupt, counter.repeated) == (0, 0, 0, 0)
    assert counter.take([bad], 9.0) == []
    assert counter.heard == 2.5
    command = MessageCounter("COMMAND")
    for k in (3, 3, 9):
        command.take([codec.encode("COMMAND", k, {"request": "none", **KEEP})], 0.0)
    assert (command.frames, command.lost, command.repeated) == (3, 0, 0)  # of several senders


def test_the_rate_is_over_two_seconds() -> None:
    counter = MessageCounter("LEVER_SAMPLE")
    assert counter.rate != counter.rate
    frame = codec.encoder("LEVER_SAMPLE")(0, 0.1, 0.2, 0.3)
    for step in range(60):
        counter.take([frame] * (10 if step < 30 else 20), 0.1 * step)
        counter.tick(0.1 * step)
    assert counter.rate == pytest.approx(200.0)


def test_a_recording_counts_what_is_of_no_message(tmp_path: Path) -> None:
    with Spy() as bus:
        sample = codec.encoder("LEVER_SAMPLE")(0, 0.1, 0.2, 0.3)
        bus.coming = [
            can.Message(arbitration_id=0x110, is_extended_id=False, data=sample),
            can.Message(arbitration_id=0x110, is_extended_id=True, data=sample),
            can.Message(arbitration_id=0x110, is_extended_id=False, is_remote_frame=True),
            can.Message(arbitration_id=0x7AA, is_extended_id=False),
            can.Message(is_error_frame=True),
        ]
        recorder = Recorder(bus, tmp_path / "a.log", "x")
        recorder.run(lambda: not bus.coming, lambda _: None)
    assert (recorder.frames, recorder.others, recorder.error_frames) == (5, 3, 1)
    assert (recorder.lost, recorder.corrupt, recorder.messages[0x110].frames) == (0, 0, 1)
    assert recorder.bus_state == "active"
    assert len((tmp_path / "a.log").read_text().splitlines()) == 5
    assert " x " in (tmp_path / "a.log").read_text().splitlines()[0]
