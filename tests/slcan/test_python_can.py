"""The codec against python-can's slcan, which knows nothing of it: each reads what the other has written."""

from __future__ import annotations

import random
from collections.abc import Callable

import can
import pytest
from can.interfaces.slcan import slcanBus
from slcan.peer import COMPILERS, Frame, Peer, Port, read_frame

pytestmark = pytest.mark.requires(COMPILERS)

Open = Callable[..., slcanBus]
MANY = 2000


@pytest.fixture
def peer() -> Peer:
    return Peer()


@pytest.fixture
def open_bus(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> Open:
    """open_bus(**options): python-can's bus to the peer."""
    return lambda **options: connect(monkeypatch, Port(peer, peer.output), **options)


def connect(monkeypatch: pytest.MonkeyPatch, port: Port, **options: object) -> slcanBus:
    monkeypatch.setattr("can.interfaces.slcan.serial.serial_for_url", lambda *_, **__: port)
    return slcanBus("anything", sleep_after_open=0.0, **options)  # type: ignore[arg-type]


def random_frame(source: random.Random) -> Frame:
    extended, remote, length = source.random() < 0.5, source.random() < 0.2, source.randint(0, 8)
    data = b"" if remote else source.randbytes(length)
    return Frame(source.getrandbits(29 if extended else 11), data, length, extended, remote)


def as_message(frame: Frame) -> can.Message:
    return can.Message(
        arbitration_id=frame.id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        dlc=frame.length,
        data=frame.data,
    )


def of_message(message: can.Message) -> Frame:
    return Frame(
        message.arbitration_id, bytes(message.data), message.dlc, message.is_extended_id, message.is_remote_frame
    )


def test_every_frame_that_it_sends_arrives(open_bus: Open, peer: Peer) -> None:
    source = random.Random(1)
    frames = [random_frame(source) for _ in range(MANY)]
    with open_bus(bitrate=1_000_000) as bus:
        for frame in frames:
            bus.send(as_message(frame))
    assert peer.received == frames


@pytest.mark.parametrize("time_stamps", [False, True])
def test_every_frame_that_is_sent_to_it_arrives(open_bus: Open, peer: Peer, time_stamps: bool) -> None:
    source = random.Random(2)
    peer.take(b"Z1\r" if time_stamps else b"Z0\r")
    with open_bus() as bus:
        for count in range(MANY):
            frame = random_frame(source)
            assert peer.send(frame, source.getrandbits(32))
            heard = bus.recv(1.0)
            while heard is None:  # an answer to a command is none to recv()
                heard = bus.recv(0.0)
            assert of_message(heard) == frame, count


@pytest.mark.parametrize(("rate", "command"), slcanBus._BITRATES.items())
def test_its_bit_rates(open_bus: Open, peer: Peer, rate: int, command: str) -> None:
    with open_bus(bitrate=rate):
        known = command != "S9"  # which LAWICEL's protocol has not: refused, and the rate stays as it was
        assert peer.state.bit_rate == (int(command[1:]) if known else 8)
        assert peer.state.channel == peer.lib.SLCAN_CHANNEL_OPEN
    assert peer.state.channel == peer.lib.SLCAN_CHANNEL_CLOSED


def test_it_listens_only(open_bus: Open, peer: Peer) -> None:
    with open_bus(listen_only=True, bitrate=500_000) as bus:
        assert peer.state.channel == peer.lib.SLCAN_CHANNEL_LISTEN
        bus.send(can.Message(arbitration_id=0x110, is_extended_id=False))
        assert peer.received == []
        assert peer.state.counts.refused > 0


def test_lines_that_it_takes_for_a_frame_are_that_frame_or_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the codec takes for a frame, python-can takes for the same; what that cannot read, the codec refuses."""
    source, incoming = random.Random(3), bytearray()
    bus = connect(monkeypatch, Port(None, incoming))
    taken = refused = 0
    for _ in range(20 * MANY):
        line = damaged_line(source)
        incoming += line + b"\r"
        found = read_frame(line)
        try:
            theirs, _ = bus._recv_internal(0.0)
        except (ValueError, IndexError):  # not hexadecimal, too short
            theirs = None
        if found is None:
            refused += 1
        else:
            taken += 1
            assert theirs is not None, line
            assert of_message(theirs) == found, line
    bus.shutdown()
    assert min(taken, refused) > MANY


def damaged_line(source: random.Random) -> bytes:
    """Return a line with a frame, with or without a time stamp, in which up to two characters are changed, lost or
    doubled."""
    frame = random_frame(source)
    peer_line = f"{frame.id:08X}" if frame.extended else f"{frame.id:03X}"
    kind = ("R" if frame.extended else "r") if frame.remote else ("T" if frame.extended else "t")
    stamp = f"{source.randrange(60000):04X}" if source.random() < 0.3 else ""
    text = bytearray(f"{kind}{peer_line}{frame.length}{frame.data.hex()}{stamp}".encode())
    for _ in range(source.randint(0, 2)):
        place = source.randrange(len(text))
        change = source.randrange(3)
        if change == 0:
            text[place] = source.choice(b"0123456789ABCDEFabcdefgtTrRzZ xX-+_")
        elif change == 1 and len(text) > 1:
            del text[place]
        else:
            text.insert(place, text[place])
    return bytes(text)
