"""How long an interrupt may have to wait: cycles with interrupts off, and in each interrupt, as the image runs.

Cycles are those of tests/target/budget/cycles.py, without wait states of flash, and with those of the peripherals' bus.
"""

from __future__ import annotations

from typing import Any

from target.budget import trace
from target.budget.cycles import TAKEN
from target.bxcan.board import Board
from target.bxcan.machine import ACCESS_CYCLES
from unicorn import UC_HOOK_CODE, Uc

MASK, UNMASK, SLEEP = "cpsid", "cpsie", "wfi"


class Latency:
    """From its making on, of a board. `off` is the longest section by the function that begins it, `interrupts` the
    longest run of each handler by its name; both [cycles]."""

    def __init__(self, board: Board) -> None:
        self.off: dict[str, int] = {}
        self.interrupts: dict[str, int] = {}
        self._machine = board.machine
        self._cortex = board.chip.cortex
        self._code = {
            address: (each.mnemonic.split(".")[0], each.cycles)
            for address, each in trace.disassemble(board.machine.image.path).items()
        }
        self._names = {address & ~1: name for name, address in board.machine.image.symbols.items()}
        self._section: str | None = None
        self._handler: str | None = None
        self._spent = self._spent_in_handler = 0
        self._ends = -1  # where the last instruction ends: what goes on elsewhere has jumped
        cpu = board.machine.cpu
        cpu.ctl_flush_tb()
        cpu.hook_add(UC_HOOK_CODE, self._executed)
        for access in ("read", "write"):
            self._slow(board, access)

    def _slow(self, board: Board, access: str) -> None:
        """Make an access to a peripheral take longer."""
        real = getattr(board.chip, access)

        def slowed(*arguments: int) -> Any:
            self._spend(ACCESS_CYCLES)
            return real(*arguments)

        setattr(board.chip, access, slowed)

    def _spend(self, count: int) -> None:
        if self._section is not None:
            self._spent += count
        if self._handler is not None:
            self._spent_in_handler += count

    def _executed(self, _cpu: Uc, address: int, size: int, _data: object) -> None:
        mnemonic, count = self._code[address]
        was_handler = self._handler is not None
        if not self._cortex.active:
            self._end_handler()
        elif not was_handler or (address in self._names and self._names[address].endswith("_interrupt")):
            self._end_handler()
            self._handler = self._names.get(address, "?")
        elif address != self._ends:
            self._spend(TAKEN)
        if not was_handler and not self._cortex.active and address != self._ends:
            self._spend(TAKEN)
        self._ends = address + size
        if mnemonic == MASK and self._section is None:
            self._section = self._machine.image.describe(address).partition("+")[0].removeprefix("in ")
            self._spent = 0
        self._spend(count)
        if mnemonic == UNMASK and self._section is not None:
            self.off[self._section] = max(self._spent, self.off.get(self._section, 0))
            self._section = None

    def _end_handler(self) -> None:
        if self._handler is not None:
            longest = max(self._spent_in_handler, self.interrupts.get(self._handler, 0))
            self.interrupts[self._handler] = longest
        self._handler, self._spent_in_handler = None, 0
