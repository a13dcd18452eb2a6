"""What goes wrong on a bus and in a processor: destroyed frames, bus-off, overrun, a loop that hangs, a hard fault."""

from __future__ import annotations

import pytest
from lever_cdkf.firmware.native import lib
from target.bxcan.board import MS, Board
from target.bxcan.bus import BIT_NS
from target.bxcan.chip import SOFTWARE_RESET, WATCHDOG_RESET
from target.bxcan.talk import Talk, answers, is_estimate, sample

HANG = b"\xfe\xe7"
"""b . (DDI 0403E A7.7.12)"""
UNDEFINED = b"\x00\xde"
"""udf #0 (A7.7.194)"""
RECOVERY_NS = 128 * 11 * BIT_NS


def test_destroyed_frames_are_sent_again_and_shown(talk: Talk, board: Board) -> None:
    """ISO 11898-1: each destroyed transmission counts 8, each good one 1 less; as a receiver 1 and 1."""
    talk.report("PLATFORM_HEALTH")
    talk.send()
    assert board.machine.run(MS, lambda: not board.peer.queue)
    board.bus.disturb = 5
    board.run(2 * MS)
    assert sum(map(is_estimate, board.peer.frames())) == talk.next, "the answer has come all the same"
    assert board.can.confinement.transmit > 30
    report = talk.report("PLATFORM_HEALTH")
    assert 0 < int(report["transmit_errors"]) <= 40
    assert report["dropped"] == report["bus_offs"] == 0


def test_nobody_acknowledges(talk: Talk, board: Board) -> None:
    """The other node is gone: the answer is tried for a while and then dropped; what comes after its return is new."""
    talk.report("PLATFORM_HEALTH")
    talk.send()
    assert board.machine.run(MS, lambda: not board.peer.queue)
    board.peer.is_connected = False
    board.run(10 * MS)
    assert any(box.is_pending for box in board.can.tx.boxes)
    assert board.can.confinement.transmit == 128
    board.run(90 * MS)
    assert not any(box.is_pending for box in board.can.tx.boxes)
    assert board.machine.resets == []
    board.peer.is_connected = True
    board.run(5 * MS)
    assert sum(map(is_estimate, board.peer.frames())) == talk.next - 1
    report = talk.report("PLATFORM_HEALTH")
    assert report["dropped"] == 1
    assert report["bus_offs"] == 0
    assert 0 < report["transmit_errors"] < 128


def test_error_counters_are_those_of_the_controller(talk: Talk, board: Board) -> None:
    talk.ask()
    confinement = board.can.confinement
    confinement.transmit, confinement.receive = 90, 17
    seen = talk.report("PLATFORM_HEALTH")
    sent_meanwhile = 90 - confinement.transmit
    assert sent_meanwhile > 0
    assert 90 - sent_meanwhile <= int(seen["transmit_errors"]) < 90
    assert int(seen["receive_errors"]) == max(0, 17 - 2 * (talk.next - 1))


def go_off_the_bus(talk: Talk) -> None:
    """Shorts the bus while the image answers a sample, until its controller is off."""
    board = talk.board
    talk.send()
    assert board.machine.run(2 * MS, lambda: board.bus.sender is board.can)
    board.bus.is_shorted = True
    assert board.machine.run(20 * MS, lambda: board.can.confinement.is_off)
    assert board.machine.run(MS, lambda: not any(box.is_pending for box in board.can.tx.boxes)), "old answers are kept"


@pytest.mark.requirement("R47")
def test_bus_off_and_recovery(talk: Talk, board: Board) -> None:
    talk.report("PLATFORM_HEALTH")
    go_off_the_bus(talk)
    off_at = board.schedule.now
    board.bus.is_shorted = False
    assert board.machine.run(20 * MS, lambda: not board.can.confinement.is_off)
    assert board.schedule.now - off_at == pytest.approx(RECOVERY_NS, abs=30 * BIT_NS)
    assert board.can.confinement.register() == 0
    board.run(5 * MS)
    estimates = sum(map(is_estimate, board.peer.frames()))
    assert estimates == talk.next - 1, "an answer from before has come after"
    for _ in range(5):
        talk.ask()
    report = talk.report("PLATFORM_HEALTH")
    assert report["bus_offs"] == board.can.bus_offs == 1
    assert int(report["dropped"]) >= 1
    assert int(report["faults"]) == lib.LEVER_PLATFORM_DROPPED
    assert board.machine.resets == []


def test_each_bus_off_is_counted_once_and_the_estimator_goes_on(talk: Talk, board: Board) -> None:
    talk.report("PLATFORM_HEALTH")
    for _ in range(3):
        go_off_the_bus(talk)
        board.bus.is_shorted = False
        board.machine.run(20 * MS, lambda: not board.can.confinement.is_off)
        board.run(MS)
        talk.ask()
    report = talk.report("PLATFORM_HEALTH")
    assert report["bus_offs"] == board.can.bus_offs == 3
    talk.expected()
    answer = talk.ask()[-1]
    assert is_estimate(answer)
    assert answer.data[2:] == talk.expected()[-1].data[2:], "no sample was lost, so the estimate is the same"


def test_bus_that_stays_short(talk: Talk, board: Board) -> None:
    """For as long as it lasts the image neither resets nor hangs."""
    talk.ask()
    go_off_the_bus(talk)
    board.run(300 * MS)
    assert board.machine.resets == []
    board.bus.is_shorted = False
    board.run(5 * MS)
    assert is_estimate(talk.ask()[-1])


@pytest.mark.parametrize(("frames", "lost"), [(3, 0), (4, 1), (8, 5)])
@pytest.mark.requirement("R47")
def test_fifo_overrun_is_counted_and_shown(talk: Talk, board: Board, frames: int, lost: int) -> None:
    """The processor stands still, as a debugger makes it; three frames have room, and the first are kept."""
    talk.report("PLATFORM_HEALTH")
    inputs = [frame for k in range(talk.next, talk.next + frames) for frame in sample(k)][:frames]
    talk.next += (frames + 1) // 2
    talk.expected()
    heard = len(board.peer.heard)
    board.peer.send(*inputs)
    board.schedule.advance(board.schedule.now + frames * MS // 4)
    assert [message.frame for message in board.can.fifos[0].messages] == inputs[:3]
    assert board.can.fifos[0].lost == lost
    board.run(5 * MS)
    assert board.can.fifos[0].messages == []
    talk.tell_reference(*inputs[:3])
    assert answers(board.peer.frames()[heard:]) == talk.expected()
    report = talk.report("PLATFORM_HEALTH")
    assert report["overruns"] == min(1, lost), "once for a series, as RM0090's FOVR tells no more"
    assert int(report["faults"]) == (lib.LEVER_PLATFORM_OVERRUN if lost else 0)
    health = talk.report("HEALTH")
    assert health["fault_platform"] == bool(lost)


def test_watchdog_is_fed_with_and_without_samples(talk: Talk, board: Board) -> None:
    watchdog = board.chip.watchdog
    assert watchdog.is_running
    assert 10 * MS < watchdog.timeout_ns() <= 100 * MS
    fed = watchdog.feedings
    board.run(1000 * MS)
    assert 150 <= watchdog.feedings - fed <= 200, "each time that the estimator has been told of 5 ms without a sample"
    fed = watchdog.feedings
    for _ in range(50):
        talk.ask()
    assert watchdog.feedings - fed >= 20, "a millisecond has more than one of these steps"
    assert board.machine.resets == []


@pytest.mark.requirement("R46")
def test_watchdog_resets_a_loop_that_hangs(talk: Talk, board: Board) -> None:
    """Interrupts still work, and must not keep the watchdog quiet."""
    assert talk.report("PLATFORM_HEALTH")["faults"] == 0
    repair = board.machine.patch("loop_turn", HANG)
    hung_at = board.schedule.now
    board.peer.send(*sample(talk.next))
    assert board.machine.run(1000 * MS, lambda: bool(board.machine.resets))
    (reset,) = board.machine.resets
    assert reset.cause == WATCHDOG_RESET
    assert reset.time_ns - hung_at <= 100 * MS
    repair()
    board.start()
    with Talk(board) as again:
        report = again.report("PLATFORM_HEALTH")
    assert int(report["faults"]) == lib.LEVER_PLATFORM_WATCHDOG
    assert len(board.machine.resets) == 1


def test_hard_fault_is_recorded_and_resets(talk: Talk, board: Board) -> None:
    assert talk.report("PLATFORM_HEALTH")["faults"] == 0
    repair = board.machine.patch("lever_step", UNDEFINED)
    at = board.machine.image.symbols["lever_step"]
    talk.send()
    assert board.machine.run(20 * MS, lambda: bool(board.machine.resets))
    repair()
    assert [reset.cause for reset in board.machine.resets] == [SOFTWARE_RESET]
    assert board.machine.faults == [at]
    assert board.machine.word("fault_last", 8) == at, "pc of the record"
    board.start()
    with Talk(board) as again:
        report = again.report("PLATFORM_HEALTH")
    assert int(report["faults"]) == lib.LEVER_PLATFORM_HARD_FAULT
