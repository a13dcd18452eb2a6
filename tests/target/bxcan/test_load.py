"""A bus without a gap: foreign frames, our own inputs, a bus-off among them. Nothing hangs, losses are counted."""

from __future__ import annotations

import pytest
from lever_cdkf.firmware.native import lib
from target.bxcan.board import MS, Board
from target.bxcan.bus import Peer
from target.bxcan.frame import Frame
from target.bxcan.talk import HEALTH, Talk, answers, is_estimate

FOREIGN = Frame(0x7FF, b"\x55" * 8)
"""Less important than anything of ours, so that we win each arbitration, and wait for the end of each frame."""


def fill(board: Board, frame: Frame, time_ns: int) -> Peer:
    """Return another node that leaves no gap, for so long."""
    peer = Peer(board.bus)
    peer.send(*[frame] * (time_ns // (len(frame.wire) * 1000)))
    return peer


@pytest.mark.requirement("R47")
def test_every_sample_is_answered_between_foreign_frames(talk: Talk, board: Board) -> None:
    """The bus is full, and each answer takes the place of a foreign frame; none of those reaches software."""
    talk.ask()
    talk.expected()
    heard, taken, count = len(board.peer.heard), board.can.fifos[0].taken, 60
    foreign = fill(board, FOREIGN, count * MS)
    start = board.schedule.now
    for k in range(count):
        board.schedule.at(start + k * MS, talk.send)
    board.run((count - 1) * MS)
    assert foreign.queue, "the bus has not been full"
    del foreign.queue[1:]  # the first may be on the bus
    board.run(3 * MS)
    ours = [frame for frame in board.peer.frames()[heard:] if frame != FOREIGN]
    assert answers(ours) == talk.expected()
    assert board.can.fifos[0].taken - taken == 2 * count
    report = talk.report("PLATFORM_HEALTH")
    assert report["dropped"] == report["overruns"] == report["bus_offs"] == 0
    assert board.machine.resets == []


@pytest.mark.requirement("R47")
def test_inputs_without_a_gap_are_all_taken_and_answers_are_sent_or_counted(talk: Talk, board: Board) -> None:
    """Four samples a millisecond, which leave no room for answers; when there is room the next one is answered."""
    talk.report("PLATFORM_HEALTH")
    talk.expected()
    taken, heard, count = board.can.fifos[0].taken, len(board.peer.heard), 200
    for _ in range(count):
        talk.send()
    assert board.machine.run(100 * MS, lambda: not board.peer.queue)
    board.run(30 * MS)
    assert board.machine.resets == []
    assert (board.can.fifos[0].taken - taken, board.can.fifos[0].lost) == (2 * count, 0)
    sent = [frame for _, frame in board.peer.heard[heard:]]
    assert 0 < sum(map(is_estimate, sent)) < count, "there has been room for all"
    expected = talk.expected()
    produced = len(expected) + sum(frame.identifier == HEALTH for frame in expected)  # each with PLATFORM_HEALTH
    report = talk.report("PLATFORM_HEALTH")
    assert report["dropped"] == (produced - len(sent)) % 256
    assert report["overruns"] == 0
    assert report["faults"] == lib.LEVER_PLATFORM_DROPPED
    assert is_estimate(talk.ask()[-1])


@pytest.mark.requirement("R47")
def test_bus_off_while_the_bus_is_full(talk: Talk, board: Board) -> None:
    """The controller goes off, comes back when the bus allows, and answers again."""
    talk.report("PLATFORM_HEALTH")
    foreign = fill(board, FOREIGN, 60 * MS)
    talk.send()
    assert board.machine.run(5 * MS, lambda: board.bus.sender is board.can)
    board.bus.is_shorted = True
    assert board.machine.run(20 * MS, lambda: board.can.confinement.is_off)
    board.bus.is_shorted = False
    assert board.machine.run(100 * MS, lambda: not board.can.confinement.is_off), "128 times 11 recessive bits"
    assert foreign.queue, "the bus has been full meanwhile"
    assert is_estimate(talk.ask()[-1])
    report = talk.report("PLATFORM_HEALTH")
    assert report["bus_offs"] == board.can.bus_offs == 1
    assert board.machine.resets == []
