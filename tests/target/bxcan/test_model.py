"""The model of CAN1 does what RM0090 chapter 32 says; tests play the software."""

from __future__ import annotations

import pytest
from target.bxcan.bus import BIT_NS
from target.bxcan.bxcan import ABOM, BTR, ESR, IER, INRQ, MCR, MSR, RF0R, RFLM, TSR, TXFP
from target.bxcan.fifo import FOVR, FULL, RFOM
from target.bxcan.filters import FA1R, FMR, FMR_RESET
from target.bxcan.frame import Frame
from target.bxcan.pokes import BTR_1_MBIT, Desk

SAMPLE = Frame(0x110, bytes(range(8)))


def test_reset_values(desk: Desk) -> None:
    """Table 182 of RM0090."""
    values = {MCR: 0x00010002, MSR: 0xC02, TSR: 0x1C000000, RF0R: 0, IER: 0, ESR: 0, BTR: 0x01230000, FMR: 0x2A1C0E01}
    assert {offset: desk.read(offset) for offset in values} == values


def test_way_to_normal_mode(desk: Desk) -> None:
    desk.initialise()
    desk.write(BTR, BTR_1_MBIT)
    desk.write(FA1R, 1)
    desk.write(FMR, FMR_RESET & ~1)
    desk.write(MCR, ABOM)
    desk.wait(10)
    assert desk.read(MSR) & 1, "eleven recessive bits have not gone by"
    desk.wait(1)
    assert desk.read(MSR) & 3 == 0
    assert desk.misuses == []
    assert desk.can.bit_time_ns() == pytest.approx(1000)
    assert desk.can.sample_point() == pytest.approx(12 / 14)


def test_initialisation_waits_for_the_end_of_transmission(desk: Desk) -> None:
    desk.start()
    desk.load(0, SAMPLE)
    desk.wait(50)
    desk.write(MCR, INRQ | ABOM)
    desk.wait(10)
    assert desk.read(MSR) & 1 == 0
    desk.wait(200)
    assert desk.read(MSR) & 1
    assert desk.peer.frames() == [SAMPLE]


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x7FF, b"\1\2\3"),
        Frame(0x1ABCDEF0, bytes(8), extended=True),
        Frame(5, remote=True, dlc=4),
        Frame(0),
    ],
)
def test_frames_go_out_and_come_in_as_they_are(desk: Desk, frame: Frame) -> None:
    desk.start()
    desk.load(1, frame)
    start = desk.schedule.now
    desk.wait(200)
    assert desk.peer.frames() == [frame]
    assert desk.peer.heard[0][0] - start == (1 + len(frame.wire)) * BIT_NS
    assert desk.read(TSR) == 0x1C000000 | 3 << 8
    desk.write(TSR, 1 << 8)
    assert desk.read(TSR) == 0x1C000000
    desk.peer.send(frame)
    desk.wait(200)
    assert desk.read(RF0R) == 1
    wanted = frame.identifier << 3 | 4 if frame.extended else frame.identifier << 21
    assert desk.read(0x1B0) == wanted | frame.remote << 1
    assert desk.read(0x1B4) == frame.length
    raw = (desk.read(0x1B8) | desk.read(0x1BC) << 32).to_bytes(8, "little")
    assert raw[: len(frame.data)] == frame.data
    desk.write(RF0R, RFOM)
    assert desk.read(RF0R) == RFOM | 1
    desk.wait(1)
    assert desk.read(RF0R) == 0
    assert desk.misuses == []


def test_order_of_requests_decides_with_txfp(desk: Desk) -> None:
    desk.start(TXFP | ABOM)
    for mailbox, identifier in enumerate((0x300, 0x100, 0x200)):
        desk.load(mailbox, Frame(identifier))
    desk.wait(400)
    assert [frame.identifier for frame in desk.peer.frames()] == [0x300, 0x100, 0x200]


def test_pending_mailbox_can_be_aborted_but_not_one_that_is_sent(desk: Desk) -> None:
    desk.start()
    desk.load(0, Frame(0x100))
    desk.load(1, Frame(0x200))
    desk.wait(10)
    desk.write(TSR, 0x80 | 0x8000)
    assert desk.read(TSR) & 0x0F0F == 0x0100, "mailbox 1 completed without TXOK"
    desk.wait(200)
    assert [frame.identifier for frame in desk.peer.frames()] == [0x100]
    assert desk.read(TSR) & 0x0F == 3


@pytest.mark.parametrize(("mcr", "kept"), [(ABOM, [0, 1, 4]), (ABOM | RFLM, [0, 1, 2])])
def test_fifo_overrun(desk: Desk, mcr: int, kept: list[int]) -> None:
    """32.7.3: without RFLM the last message is overwritten, with it the new one is lost."""
    desk.start(mcr)
    desk.peer.send(*(Frame(0x100 + k) for k in range(5)))
    desk.wait(600)
    assert desk.read(RF0R) == 3 | FULL | FOVR
    assert [message.frame.identifier - 0x100 for message in desk.can.fifos[0].messages] == kept
    assert desk.can.fifos[0].lost == 2
    desk.write(RF0R, FOVR | FULL)
    assert desk.read(RF0R) == 3


def test_nobody_acknowledges(desk: Desk) -> None:
    """ISO 11898-1 10.11: a lone node becomes passive and stays so: its counter ends at 128."""
    desk.start()
    desk.peer.is_connected = False
    desk.load(0, SAMPLE)
    desk.wait(16 * 150)
    assert desk.read(ESR) & 7 == 3
    desk.wait(5000)
    assert desk.read(ESR) == 128 << 16 | 3 << 4 | 3
    desk.peer.is_connected = True
    desk.wait(400)
    assert desk.peer.frames() == [SAMPLE]
    assert desk.read(ESR) >> 16 == 127


def test_bus_off_and_recovery(desk: Desk) -> None:
    desk.start()
    desk.write(IER, 1 << 15 | 1 << 10)
    desk.bus.is_shorted = True
    desk.load(0, SAMPLE)
    while not desk.read(ESR) & 4:
        assert desk.schedule.now < 10_000_000
        assert desk.can.interrupts() == set()
        desk.wait(1)
    assert desk.can.bus_offs == 1
    assert desk.can.interrupts() == {22}
    desk.write(MSR, 4)
    assert desk.can.interrupts() == set()
    desk.bus.is_shorted = False
    desk.wait(128 * 11 - 20)
    assert desk.read(ESR) & 4
    assert desk.peer.frames() == []
    desk.wait(20 + 200)
    assert desk.read(ESR) == 0
    assert desk.peer.frames() == [SAMPLE]


def test_receive_errors(desk: Desk) -> None:
    desk.start()
    desk.bus.disturb = 3
    desk.peer.send(SAMPLE)
    desk.wait(116)
    assert desk.read(ESR) == 3 << 24 | 1 << 4
    desk.wait(200)
    assert desk.read(ESR) == 2 << 24
    assert desk.read(RF0R) == 1
    assert desk.peer.failed == 3


def test_interrupts(desk: Desk) -> None:
    desk.start()
    desk.peer.send(*[SAMPLE] * 4)
    desk.wait(600)
    asked = {}
    for bit in range(7):
        desk.write(IER, 1 << bit)
        asked[bit] = desk.can.interrupts()
    assert asked == {0: set(), 1: {20}, 2: {20}, 3: {20}, 4: set(), 5: set(), 6: set()}
    desk.load(0, SAMPLE)
    desk.wait(200)
    desk.write(IER, 1)
    assert desk.can.interrupts() == {19}
    desk.write(TSR, 1)
    assert desk.can.interrupts() == set()
