"""The model of CAN1 reports what RM0090 chapter 32 forbids: without that, no driver could fail here."""

from __future__ import annotations

import pytest
from target.bxcan.bxcan import BTR, INRQ, MAILBOXES, MCR, RF0R, RF1R
from target.bxcan.fifo import RFOM
from target.bxcan.filters import FM1R, FMR
from target.bxcan.frame import Frame
from target.bxcan.pokes import BTR_1_MBIT, Desk

SAMPLE = Frame(0x110, bytes(range(8)))


@pytest.mark.parametrize(
    ("offset", "value", "said"),
    [
        pytest.param(BTR, BTR_1_MBIT, "BTR is written outside initialisation mode", id="bit timing on the bus"),
        pytest.param(FM1R, 1, "FM1R while FINIT is 0", id="filter mode without FINIT"),
        pytest.param(0x240, 1, "bank 0 while it is active", id="filter bank in use"),
        pytest.param(RF0R, RFOM, "releases FIFO 0, which is empty", id="release of an empty FIFO"),
        pytest.param(MCR, 1 << 20, "reserved bits of MCR", id="reserved bits of MCR"),
        pytest.param(FMR, 0, "reserved bits of FMR", id="reserved bits of FMR"),
        pytest.param(RF1R, 1 << 7, "reserved bits of RF1R", id="reserved bits of RF1R"),
        pytest.param(0x20, 1, "register 0x20", id="reserved register"),
        pytest.param(0x1B0, 1, "register 0x1b0", id="message in a FIFO"),
        pytest.param(MAILBOXES + 4, 9, "9 data bytes", id="nine data bytes"),
        pytest.param(MAILBOXES, 0x110 << 3 | 1, "extended identifier bits", id="identifier at the wrong place"),
    ],
)
def test_write(desk: Desk, offset: int, value: int, said: str) -> None:
    desk.start()
    assert desk.misuses == []
    desk.write(offset, value)
    assert len(desk.misuses) == 1
    assert said in desk.misuses[0]


def test_occupied_mailbox(desk: Desk) -> None:
    desk.start()
    desk.load(0, SAMPLE)
    desk.write(MAILBOXES + 8, 0)
    assert desk.misuses == ["CAN1: writes transmit mailbox 0 while it is occupied"]
    desk.wait(200)
    assert desk.peer.frames() == [SAMPLE]


def test_message_of_an_empty_fifo(desk: Desk) -> None:
    desk.start()
    desk.read(0x1C0)
    assert desk.misuses == ["CAN1: reads a message from FIFO 1, which is empty or being released"]


def test_access_by_bytes(desk: Desk) -> None:
    desk.can.write(MCR, 1, 0)
    assert "by 1 bytes" in desk.misuses[0]
    assert desk.read(MCR) == 0x00010002


def test_clock_that_is_off(desk: Desk) -> None:
    desk.is_clocked = False
    assert desk.read(MCR) == 0
    assert "CAN1EN" in desk.misuses[0]


@pytest.mark.parametrize(
    ("btr", "pins", "said"),
    [
        (BTR_1_MBIT + 1, None, "a bit lasts 1333.3 ns"),
        (BTR_1_MBIT | 1 << 31, None, "silent"),
        (BTR_1_MBIT, "no pins", "no pins"),
    ],
)
def test_a_node_that_cannot_take_part(desk: Desk, btr: int, pins: str | None, said: str) -> None:
    desk.pins = pins
    desk.start(btr=btr)
    assert len(desk.misuses) == 1
    assert said in desk.misuses[0]
    desk.load(0, SAMPLE)
    desk.peer.send(SAMPLE)
    desk.wait(500)
    assert desk.peer.frames() == []
    assert desk.read(RF0R) == 0


def test_leaving_initialisation_with_nothing_set(desk: Desk) -> None:
    desk.write(MCR, INRQ)
    desk.wait(2)
    desk.write(MCR, 0)
    assert len(desk.misuses) == 3
    for misuse, said in zip(desk.misuses, ("BTR has not been set", "a bit lasts", "FINIT"), strict=True):
        assert said in misuse
