"""A CAN1 to be poked by hand, and boards with the image on them. Whatever the image does wrong fails its test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from target.bxcan.board import Board
from target.bxcan.pokes import Desk
from target.bxcan.talk import Talk


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.fixture
def make_board(can_image: Path) -> Iterator[Callable[..., Board]]:
    """make_board(hse_hz=0, ...): a board with the image, which has not yet started."""
    boards: list[Board] = []

    def make(**options: Any) -> Board:
        boards.append(Board(can_image, **options))
        return boards[-1]

    yield make
    misuses = [str(misuse) for board in boards for misuse in board.chip.misuses]
    assert misuses == [], "what the image does that RM0090 forbids"


@pytest.fixture
def board(make_board: Callable[..., Board]) -> Board:
    """Return a board whose image is on the bus, as if it had been built to take COMMANDs, which tests send."""
    new_board = make_board(takes_commands=True)
    new_board.start()
    return new_board


@pytest.fixture
def talk(board: Board) -> Iterator[Talk]:
    """Yield a conversation with that board."""
    with Talk(board) as conversation:
        yield conversation
