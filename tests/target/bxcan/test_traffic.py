"""Frames through the driver: the same as from the firmware in this process, in the same order, on a busy bus too."""

from __future__ import annotations

import math
from collections.abc import Callable

import can
import numpy as np
import pytest
from lever_cdkf.can import codec
from lever_cdkf.can.commander import result_of
from lever_cdkf.firmware.config import CHOICES
from lever_cdkf.firmware.native import lib
from lever_sil.run import loop
from lever_sil.scenarios import scenario
from target.bxcan.board import MS, Board, BoardBus
from target.bxcan.bus import Peer
from target.bxcan.frame import Frame
from target.bxcan.talk import COMMAND, OF_MACHINE, STATE_ESTIMATE, Talk, answers, is_estimate

ACK, MOTOR_COMMAND = (codec.message(name).frame_id for name in ("COMMAND_ACK", "MOTOR_COMMAND"))
URGENT = Frame(0x010, b"\x55" * 8)
"""Of another node, more important than anything of ours."""


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("steady", ["duration=1.5 s"]),
        ("steady", ["duration=0.6 s", "estimator.estimator=joint", "estimator.adaptation=forgetting"]),
        ("linear_black_box", ["duration=0.6 s", "estimator.estimator=joint"]),
        ("linear_physical", ["duration=0.6 s", "settings={}"]),  # the image has its own
    ],
)
def test_a_scenario_gives_the_frames_of_the_firmware_in_this_process(
    board: Board, name: str, changes: list[str]
) -> None:
    """Bit for bit, every frame but those of a machine, which the firmware in this process has no board for."""
    played = scenario.load(name, changes)
    bus = BoardBus(board)
    there = loop.run(played, bus).frames()
    bus.shutdown()
    with can.Bus(interface="lever") as reference:
        here = loop.run(played, reference).frames()
    ours = ~np.isin(there.identifier, OF_MACHINE)
    assert there.identifier[ours].tolist() == here.identifier.tolist()
    assert there.data[ours].tobytes() == here.data.tobytes()
    assert len(there.of(STATE_ESTIMATE)) == len(played.time())
    assert board.machine.resets == []


def command(counter: int, **values: codec.Value) -> Frame:
    keep: dict[str, codec.Value] = {"request": "none", "dither_rms": math.inf, **dict.fromkeys(CHOICES, "keep")}
    return Frame(COMMAND, codec.encode("COMMAND", counter, keep | values))


def dither(talk: Talk) -> None:
    """From now on a motor command goes out with every estimate."""
    talk.tell(command(0, dither_rms=0.3))


@pytest.mark.requirement("S1", "R24")
def test_the_image_as_it_is_shipped_only_ends_something_by_command(make_board: Callable[..., Board]) -> None:
    """It says so in each COMMAND_ACK; what changes nothing, or ends learning, is accepted, and what begins it again is
    not. `dither` above is obeyed by the same image as it is built with -D LEVER_COMMANDS=ON."""
    board = make_board()
    board.start()
    asked = [
        (command(0, dither_rms=0.3), "disabled", lib.LEVER_MODE_RUN),
        (command(1, model="hand"), "disabled", lib.LEVER_MODE_RUN),
        (command(2, request="freeze", dither_rms=0.3), "disabled", lib.LEVER_MODE_RUN),
        (command(3), "accepted", lib.LEVER_MODE_RUN),
        (command(4, request="freeze"), "accepted", lib.LEVER_MODE_FROZEN),
        (command(5, request="run"), "disabled", lib.LEVER_MODE_FROZEN),
    ]
    with Talk(board) as talk:
        for _ in range(350):
            talk.ask()
        for frame, _, mode in asked:
            board.peer.send(frame)
            board.run(MS)
            for _ in range(50):
                talk.ask()
            assert talk.report("HEALTH")["mode"] == mode
    heard = board.peer.frames()
    acks = [codec.decode(ACK, frame.data)[1] for frame in heard if frame.identifier == ACK]
    results = [result for _, result, _ in asked]
    assert [(ack["command_counter"], result_of(ack)) for ack in acks] == list(enumerate(results))
    assert {ack["dither_rms"] for ack in acks} == {0.0}
    assert not [frame for frame in heard if frame.identifier == MOTOR_COMMAND]
    assert board.machine.resets == []


def test_keeps_up_with_samples_each_millisecond(talk: Talk, board: Board) -> None:
    """Not in lock-step: the sensors do not wait."""
    for _ in range(350):
        talk.ask()
    talk.expected()
    heard = len(board.peer.heard)
    dither(talk)
    start, count = board.schedule.now + MS, 250
    for k in range(count):
        board.schedule.at(start + k * MS, talk.send)
    board.run((count + 3) * MS)  # within the 5 ms after which lever_idle() speaks
    expected = talk.expected()
    assert answers(board.peer.frames()[heard:]) == expected
    assert len(expected) > 2 * count
    times = [time for time, frame in board.peer.heard[heard:] if is_estimate(frame)]
    lateness = [time - start - k * MS for k, time in enumerate(times)]
    assert max(lateness) < 2 * MS, "the frames of a whole step take 1.1 ms on the bus"


def send_ahead_of(talk: Talk, urgent: Peer, count: int) -> None:
    """Send a sample, with so many urgent frames ready before it can be answered."""
    board = talk.board
    talk.send()
    assert board.machine.run(MS, lambda: len(board.peer.queue) == 1 and board.bus.sender is board.peer)
    urgent.send(*[URGENT] * count)


def test_order_is_kept_on_a_busy_bus(talk: Talk, board: Board) -> None:
    """For 8 ms another node leaves no gap: the answers to two samples wait in mailboxes and queue."""
    urgent = Peer(board.bus)
    talk.ask()
    talk.expected()
    heard = len(board.peer.heard)
    send_ahead_of(talk, urgent, 65)
    talk.send()
    pending = 0

    def all_answered() -> bool:
        nonlocal pending
        pending = max(pending, sum(box.is_pending for box in board.can.tx.boxes))
        ours = [frame for frame in board.peer.frames()[heard:] if frame != URGENT]
        return sum(map(is_estimate, ours)) == 2

    assert board.machine.run(40 * MS, all_answered)
    board.run(MS)
    received = [frame for frame in board.peer.frames()[heard:] if frame != URGENT]
    assert answers(received) == talk.expected()
    assert is_estimate(received[-1])
    assert not urgent.queue


def test_all_mailboxes_wait(talk: Talk, board: Board) -> None:
    """And identifiers do not decide: STATE_ESTIMATE ends a step though its own is the least."""
    urgent = Peer(board.bus)
    dither(talk)
    waited = 0
    for _ in range(120):
        heard = len(board.peer.heard)
        send_ahead_of(talk, urgent, 10)
        board.run(MS)
        waited = max(waited, sum(box.is_pending for box in board.can.tx.boxes))
        board.run(2 * MS)  # within the 5 ms after which lever_idle() speaks
        received = [frame for frame in answers(board.peer.frames()[heard:]) if frame != URGENT]
        assert received == talk.expected()
        assert is_estimate(received[-1])
    assert waited == 3


def test_torque_ends_when_samples_do(talk: Talk, board: Board) -> None:
    """It fades: the last MOTOR_COMMAND asks for nothing, and no more come."""
    for _ in range(350):
        talk.ask()
    dither(talk)
    for _ in range(250):
        talk.ask()
    heard = len(board.peer.heard)
    board.run(200 * MS)
    faded = board.peer.frames()[heard:]
    torques = [codec.decode(frame.identifier, frame.data)[1]["torque"] for frame in faded]
    assert len(torques) >= 2
    assert torques[-1] == 0.0
    board.run(200 * MS)
    assert board.peer.frames()[heard:] == faded


def test_answers_that_wait_too_long_are_dropped_and_counted(talk: Talk, board: Board) -> None:
    """A bus that is taken for 60 ms: a motor command must not come out long after its sample."""
    urgent = Peer(board.bus)
    talk.report("PLATFORM_HEALTH")
    heard = len(board.peer.heard)
    send_ahead_of(talk, urgent, 500)
    board.run(70 * MS)
    assert not urgent.queue
    assert board.machine.resets == []
    assert [frame for frame in board.peer.frames()[heard:] if frame != URGENT] == []
    report = talk.report("PLATFORM_HEALTH")
    assert report["dropped"] > 0
    assert int(report["faults"]) == lib.LEVER_PLATFORM_DROPPED
