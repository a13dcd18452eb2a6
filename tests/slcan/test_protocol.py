"""The SLCAN peer's answer to every command in every state, after LAWICEL's manuals of the CAN232 and CANUSB; its
acceptance filter after the data sheet of the SJA1000 (6.4.15, dual filter)."""

from __future__ import annotations

import pytest
from slcan.peer import IDENTITY, Frame, Peer

VERSION, SERIAL = (text.encode() for text in IDENTITY)
DATA, REMOTE = Frame(0x210, bytes(1), 1), Frame(0x7, b"", 8, remote=True)
LONGEST = b"T0000000181122334455667788"
MALFORMED_LINES = """
    t t110 t1101 t11011 t1101122 t8000 t1109 t110A t11g0 t1101g1 t11011g t-110 t11082233445566778 t1101223344
    t110811223344556677889 T1100 T200000000 T0000000 T000000009 r110 r11011 r1109 r8000 R110 R200000000 R00000000100
    x1100 d1100"""
MALFORMED = MALFORMED_LINES.split()
UNKNOWN = ("X1", "P", "A", "Q1", "W2", "U1", "Y2", "o", "c", "?", " O", "O ", "OO", "CC", "L1", "F0", "\x80", "\x01x")


@pytest.fixture
def peer() -> Peer:
    return Peer()


def says(peer: Peer, data: bytes) -> bytes:
    """Return the answer to bytes from the host."""
    peer.output.clear()
    peer.take(data)
    return bytes(peer.output)


def hears(peer: Peer, frame: Frame, time_ms: int = 0) -> bytes:
    """Return what the host gets of a frame."""
    peer.output.clear()
    assert peer.send(frame, time_ms)
    return bytes(peer.output)


@pytest.mark.parametrize(
    ("data", "answer"),
    [
        (b"C\rO\rO\rL\rC\rC\rL\rO\r", b"\a\r\a\a\r\a\r\a"),  # opened and closed once
        (b"C\rS8\rO\rC\rS6\rL\r", b"\a\r\r\r\r\r"),  # as slcand and the kernel open
        (b"O\a", b"\a"),  # a bell ends a line, too, and is refused
        (b"\r\r\rO\r\r", b"\r\r\r\r\r"),  # empty lines are good
        (b"\r\nV\r\nO\r\nt1230\r\n", b"\rV" + VERSION + b"\r\rz\r"),  # a terminal's line feeds are skipped
        (b"V\rv\rN\r", b"V" + VERSION + b"\rv" + VERSION + b"\rN" + SERIAL + b"\r"),
        (b"L\rV\rN\rV1\rN1\r", b"\rV" + VERSION + b"\rN" + SERIAL + b"\r\a\a"),
        (b"t1100\rL\rt1100\rT000000010\rr1100\rR000000010\r", b"\a\r\a\a\a\a"),  # nobody sends where it listens
        (b"O\r" + LONGEST + b"\r" + LONGEST + b"1234\r" + LONGEST + b"12345\r", b"\rZ\r\a\a"),
        (b"O\rt" + 397 * b"1" + b"\rt1100\r", b"\r\az\r"),  # too long: refused once, and over with its end
    ],
)
@pytest.mark.requirement("R51")
def test_answers(data: bytes, answer: bytes, peer: Peer) -> None:
    assert says(peer, data) == answer


def test_bit_rates_are_set_while_closed(peer: Peer) -> None:
    assert peer.state.bit_rate == 8
    for rate in range(9):
        assert says(peer, b"S%d\r" % rate) == b"\r"
        assert peer.state.bit_rate == rate
    assert says(peer, b"S9\rS\rS81\rSA\r") == b"\a\a\a\a"
    assert says(peer, b"s031C\rs031\rs031CC\rs03xC\r") == b"\r\a\a\a"
    assert (peer.state.bit_rate, peer.state.bit_timing) == (8, 0x031C)
    assert says(peer, b"S3\rO\rS4\rs031C\r") == b"\r\r\a\a"
    assert (peer.state.bit_rate, peer.state.bit_timing) == (3, 0)


@pytest.mark.requirement("R51")
def test_malformed_frames_and_unknown_commands_are_refused(peer: Peer) -> None:
    for opening in (b"", b"O\r"):
        says(peer, opening)
        for line in (*MALFORMED, "t 1100", *UNKNOWN):
            assert says(peer, line.encode("latin-1") + b"\r") == b"\a", line
    assert peer.received == []
    assert peer.state.counts.refused == 2 * (len(MALFORMED) + 1 + len(UNKNOWN))
    assert says(peer, b"t1100\r") == b"z\r"
    assert peer.received == [Frame(0x110, b"", 0)]


def test_hanging_up_forgets_a_half_line_and_closes(peer: Peer) -> None:
    says(peer, b"O\rt11")
    peer.lib.slcan_hang_up(peer.state)
    assert peer.state.channel == peer.lib.SLCAN_CHANNEL_CLOSED
    assert says(peer, b"V\r") == b"V" + VERSION + b"\r"


def test_frames_are_heard_on_an_open_channel_only(peer: Peer) -> None:
    assert hears(peer, DATA) == b""
    says(peer, b"O\r")
    assert hears(peer, Frame(0x210, b"\x0a\xb0\xff", 3)) == b"t21030AB0FF\r"
    assert hears(peer, Frame(0x1ABCDEF, b"\x5a", 1, extended=True)) == b"T01ABCDEF15A\r"
    assert hears(peer, REMOTE) == b"r0078\r"
    assert hears(peer, Frame(0x7, b"", 0, extended=True, remote=True)) == b"R000000070\r"
    says(peer, b"C\rL\r")
    assert hears(peer, DATA) == b"t210100\r"
    says(peer, b"C\r")
    assert hears(peer, DATA) == b""
    assert peer.state.counts.frames_out == 5


def test_time_stamps_are_milliseconds_of_a_minute(peer: Peer) -> None:
    assert says(peer, b"Z1\rO\r") == b"\r\r"
    for time_ms, stamp in ((0, b"0000"), (59_999, b"EA5F"), (60_000, b"0000"), (2**32 - 1, b"B8BF")):
        assert hears(peer, DATA, time_ms) == b"t210100" + stamp + b"\r"
    assert says(peer, b"Z0\rC\rZ2\rZ\rZ0\rO\r") == b"\a\r\a\a\r\r"
    assert hears(peer, DATA, 5) == b"t210100\r"


def test_what_finds_no_room_is_dropped_counted_and_said(peer: Peer) -> None:
    full = Frame(0x210, bytes(8), 8)
    says(peer, b"O\r")
    peer.room = 21
    assert not peer.send(full)
    peer.room = 22
    assert peer.send(full)
    peer.room = 0
    assert says(peer, b"F\r") == b""  # the answer is lost, and what it said is not
    assert says(peer, b"t1100\r") == b""  # the frame is taken though its acknowledgement is lost
    assert (peer.state.counts.dropped, len(peer.received)) == (3, 1)
    peer.room = None
    assert says(peer, b"F\rF\r") == b"F09\rF00\r"


def test_status_flags_are_read_on_an_open_channel_and_cleared(peer: Peer) -> None:
    lib = peer.lib
    peer.state.status = lib.SLCAN_STATUS_BUS_ERROR | lib.SLCAN_STATUS_ERROR_PASSIVE | lib.SLCAN_STATUS_ERROR_WARNING
    assert says(peer, b"F\rO\rF\rF\r") == b"\a\rFA4\rF00\r"


def is_heard(peer: Peer, identifier: int, data: bytes, extended: bool = False, remote: bool = False) -> bool:
    return hears(peer, Frame(identifier, data, len(data), extended, remote)) != b""


def test_the_filter_lets_through_what_the_manual_says(peer: Peer) -> None:
    """The CANUSB manual's example: 0x300 to 0x3FF."""
    assert says(peer, b"M00006000\rm00001FF0\rO\r") == b"\r\r\r"
    heard = [identifier for identifier in range(1, 0x800) if is_heard(peer, identifier, bytes(8))]
    assert heard == list(range(0x300, 0x400))


def test_the_filter_of_one_identifier_and_first_byte(peer: Peer) -> None:
    """Filter 1: 0x210 as data frame whose first byte is 0x5A. Filter 2: 0x7FF as remote frame."""
    says(peer, b"M4205FFFA\rm00000000\rO\r")
    for identifier, data, remote, expected in (
        (0x210, b"\x5a\0", False, True),
        (0x210, b"\x5b\0", False, False),
        (0x210, b"\x6a\0", False, False),
        (0x211, b"\x5a\0", False, False),
        (0x210, b"", False, True),  # no data byte that could differ
        (0x7FF, b"", True, True),
        (0x7FF, bytes(4), False, False),
    ):
        assert is_heard(peer, identifier, data, remote=remote) == expected


def test_the_filter_of_extended_identifiers_sees_their_upper_half(peer: Peer) -> None:
    says(peer, b"M12345678\rm00000000\rO\r")
    assert is_heard(peer, 0x1234 << 13 | 0x1555, b"", extended=True)
    assert is_heard(peer, 0x5678 << 13 | 1, b"", extended=True, remote=True)
    assert not is_heard(peer, 0x1235 << 13, b"", extended=True)
    assert says(peer, b"M0\rC\rM0\rm123456789\rM1234567g\r") == b"\a\r\a\a\a"
    assert peer.state.acceptance_code == 0x12345678
