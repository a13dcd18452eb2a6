"""These tests bite: what a driver with a fault would write to CAN1 is seeded into what the image writes, and is caught.

The fault is put between image and model, so that no other image has to be built.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from target.bxcan import test_start, test_traffic, test_trouble
from target.bxcan.board import Board
from target.bxcan.bxcan import ABOM, BTR, IER, MCR, MSR, RF0R, RFLM, TSR, TXFP
from target.bxcan.filters import BANKS, FMR
from target.bxcan.machine import MachineError
from target.bxcan.talk import Talk

Check = Callable[[Talk, Board], None]
LOST = None
"""In place of a value: what is written does not arrive."""


def seed(board: Board, register: int, fault: Callable[[int], int | None]) -> None:
    """Every value written to a register of CAN1 becomes what `fault` makes of it."""
    write = board.can.write

    def write_wrong(offset: int, size: int, value: int) -> None:
        wrong = fault(value) if offset == register else value
        if wrong is not LOST:
            write(offset, size, wrong)

    board.can.write = write_wrong  # type: ignore[method-assign]


def misuses(talk: Talk, board: Board) -> None:
    """Check at the end of every test what the fixtures have noted."""
    talk.ask()
    assert board.chip.misuses == []


def filters(talk: Talk, board: Board) -> None:
    test_start.test_filters_pass_our_identifiers_and_nothing_else(board)


def overrun(talk: Talk, board: Board) -> None:
    test_trouble.test_fifo_overrun_is_counted_and_shown(talk, board, frames=4, lost=1)


@pytest.mark.parametrize(
    ("register", "fault", "check"),
    [
        pytest.param(MCR, lambda value: value & ~TXFP, test_traffic.test_all_mailboxes_wait, id="TXFP"),
        pytest.param(MCR, lambda value: value & ~ABOM, test_trouble.test_bus_off_and_recovery, id="ABOM"),
        pytest.param(MCR, lambda value: value & ~RFLM, overrun, id="RFLM"),
        pytest.param(BTR, lambda value: value + (1 << 16), misuses, id="a quantum too many"),
        pytest.param(FMR, lambda value: value | 1, misuses, id="FINIT stays"),
        pytest.param(BANKS, lambda value: value ^ 1 << 5, filters, id="another identifier"),
        pytest.param(BANKS + 4, lambda _: LOST, filters, id="half of a filter bank"),
        pytest.param(IER, lambda value: value & ~(1 << 10), test_trouble.test_bus_off_and_recovery, id="BOFIE"),
        pytest.param(TSR, lambda _: LOST, misuses, id="RQCP stays"),
        pytest.param(TSR, lambda value: value & ~0x808080, test_trouble.test_nobody_acknowledges, id="no abort"),
        pytest.param(RF0R, lambda value: value | 1 << 5, overrun, id="releases too often"),
        pytest.param(RF0R, lambda _: LOST, misuses, id="never releases"),
        pytest.param(MSR, lambda _: LOST, test_trouble.test_bus_off_and_recovery, id="ERRI stays"),
    ],
)
def test_fault_is_caught(
    make_board: Callable[..., Board], register: int, fault: Callable[[int], int | None], check: Check
) -> None:
    board = make_board()
    seed(board, register, fault)

    def run() -> None:
        board.start()
        with Talk(board) as talk:
            check(talk, board)
            misuses(talk, board)

    with pytest.raises((AssertionError, MachineError)):
        run()
    board.chip.misuses.clear()
