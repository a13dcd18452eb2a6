"""How late an interrupt comes at the worst, against what the porting guide says and what the hardware has room for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from target.bxcan.board import MS, Board
from target.bxcan.fifo import DEPTH
from target.bxcan.frame import Frame
from target.bxcan.latency import Latency
from target.bxcan.machine import EXCEPTION_CYCLES
from target.bxcan.talk import Talk, sample
from target.bxcan.test_traffic import dither
from target.bxcan.test_trouble import go_off_the_bus

GUIDE = Path(__file__).parents[3] / "firmware/port/PORTING.md"
QUEUED, ROOM = 20, 25
"""Bytes of a frame that waits to be sent, and how many the ring holds."""
CORE_MHZ = 168
HANDLERS = {f"{name}_interrupt" for name in ("tick", "can_transmit", "can_receive", "can_error")}


def wait_stale(board: Board, count: int) -> None:
    """So many frames wait to be sent, and are too old: the most that software drops at once."""
    ring, cpu = board.machine.image.symbols["waiting"], board.machine.cpu
    got = board.machine.word("waiting", 12)
    cpu.mem_write(board.machine.image.symbols["transmit_bytes"], bytes(512))
    cpu.mem_write(ring + 8, (got + QUEUED * count).to_bytes(4, "little"))


@pytest.fixture
def latency(talk: Talk, board: Board) -> Latency:
    """Return the latency of traffic with motor commands, the march, queues of frames that are too old, a FIFO that
    is full, a bus-off."""
    for _ in range(20):
        talk.ask()
    measured = Latency(board)
    dither(talk)
    for _ in range(30):
        talk.ask()
    board.run(5 * MS)
    wait_stale(board, ROOM - 1)
    talk.ask()
    talk.send()
    assert board.machine.run(2 * MS, lambda: board.bus.sender is board.can)
    wait_stale(board, ROOM)
    board.run(5 * MS)
    board.peer.send(*[frame for k in range(talk.next, talk.next + 8) for frame in sample(k)])
    talk.next += 8
    board.schedule.advance(board.schedule.now + 2 * MS)  # the processor stands
    board.run(5 * MS)
    go_off_the_bus(talk)
    board.run(5 * MS)
    return measured


def said(pattern: str) -> tuple[int, ...]:
    match = re.search(pattern, GUIDE.read_text(encoding="utf-8"))
    assert match is not None, pattern
    return tuple(int(number.replace(",", "")) for number in match.groups())


def test_worst_latency_is_that_of_the_guide(latency: Latency) -> None:
    """All other interrupts are before it, and the longest section with interrupts off has just begun."""
    off = max(latency.off.values())
    others = [cycles for name, cycles in latency.interrupts.items() if name != "can_receive_interrupt"]
    worst = off + sum(others) + EXCEPTION_CYCLES * (1 + len(others))
    pattern = r"at most ([\d,]+) cycles \((\d+) µs\) late.*?([\d,]+) cycles with\s+interrupts off"
    stated, stated_us, stated_off = said(f"(?s){pattern}")
    assert set(latency.interrupts) == HANDLERS
    assert set(latency.off) == {"can_poll", "can_send", "wait_frame", "test_unless_in_use"}
    assert worst <= stated <= 1.1 * worst
    assert off <= stated_off <= 1.1 * off
    assert stated_us == -(-stated // CORE_MHZ)


def test_fifo_has_room_for_what_comes_meanwhile() -> None:
    """Three frames, of which the shortest have no data."""
    shortest = min(len(Frame(identifier, b"").wire) for identifier in range(0x100, 0x220))
    (_, stated_us) = said(r"at most ([\d,]+) cycles \((\d+) µs\) late")
    assert stated_us * 1000 < DEPTH * shortest * 1000
