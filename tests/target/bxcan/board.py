"""The board on a table: the image in its chip, on a bus with one other node, which is also a python-can interface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import can
from target.bxcan.bus import Bus, Peer
from target.bxcan.chip import Chip
from target.bxcan.frame import Frame
from target.bxcan.machine import Machine
from target.bxcan.schedule import Schedule

MS = 1_000_000
START_LIMIT = 500 * MS


class Board:
    """`peer` is the node that speaks with the image. Times in ns."""

    def __init__(self, elf: Path, *, takes_commands: bool = False, **chip_options: Any) -> None:
        """`takes_commands`: as if the image had been built with -D LEVER_COMMANDS=ON."""
        self.schedule = Schedule()
        self.bus = Bus(self.schedule)
        self.chip = Chip(self.bus, **chip_options)
        self.can = self.chip.can
        self.machine = Machine(elf, self.chip)
        if takes_commands:
            self.machine.answer("transport_takes_commands", 1)
        self.peer = Peer(self.bus)

    def start(self) -> None:
        """Run until the image is on the bus."""
        assert self.machine.run(START_LIMIT, lambda: self.can.acknowledges()), "the image does not join the bus"
        self.run(MS)

    def run(self, time_ns: int) -> None:
        self.machine.run(time_ns)

    def hear(self, count: int, time_ns: int = 100 * MS) -> list[Frame]:
        """Run until the peer has heard so many frames more, and return those."""
        before = len(self.peer.heard)
        self.machine.run(time_ns, lambda: len(self.peer.heard) >= before + count)
        return self.peer.frames()[before:]


class BoardBus(can.BusABC):
    """The bus of a board as python-can's: recv() lets simulated time pass, and none of the clock's."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.channel_info = "image in the simulated STM32F405"
        self._taken = len(board.peer.heard)
        super().__init__(channel="board")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.board.peer.send(Frame(msg.arbitration_id, bytes(msg.data), msg.is_extended_id, msg.is_remote_frame))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        board, heard = self.board, self.board.peer.heard
        limit = round(1e9 * (10.0 if timeout is None else timeout))
        if not board.machine.run(limit, lambda: len(heard) > self._taken):
            return None, True
        time_ns, frame = heard[self._taken]
        self._taken += 1
        message = can.Message(
            timestamp=time_ns * 1e-9,
            arbitration_id=frame.identifier,
            is_extended_id=frame.extended,
            is_remote_frame=frame.remote,
            data=frame.data,
        )
        return message, True
