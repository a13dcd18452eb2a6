"""RAM with a fault: what is read from it, or becomes of it, is wrong.

The kinds are those of van de Goor's fault models: stuck-at, transition, coupling of two bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from unicorn import UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, Uc


@dataclass(frozen=True)
class Bit:
    """Bit `number` of the word at `address`."""

    address: int
    number: int

    def get(self, cpu: Uc) -> int:
        return int(cpu.mem_read(self.address, 4)[self.number // 8]) >> self.number % 8 & 1

    def put(self, cpu: Uc, value: int) -> None:
        byte = self.address + self.number // 8
        kept = cpu.mem_read(byte, 1)[0] & ~(1 << self.number % 8)
        cpu.mem_write(byte, bytes([kept | value << self.number % 8]))


def _before_reads(cpu: Uc, bit: Bit, spoil: Callable[[], None]) -> Callable[[], None]:
    """Call spoil() before each read of the word; what is returned ends that."""
    cpu.ctl_flush_tb()  # what has run already has been translated without the hook
    hook = cpu.hook_add(UC_HOOK_MEM_READ, lambda *_: spoil(), None, bit.address, bit.address + 3)
    return lambda: cpu.hook_del(hook)


def _at_writes(cpu: Uc, bit: Bit, act: Callable[[int, int], None]) -> Callable[[], None]:
    """Call act(old, new) with the bit, before each write of its whole word."""

    def write(_cpu: Uc, _kind: int, address: int, size: int, value: int, _data: object) -> None:
        assert (address, size) == (bit.address, 4), "written in parts"
        act(bit.get(cpu), value >> bit.number & 1)

    hook = cpu.hook_add(UC_HOOK_MEM_WRITE, write, None, bit.address, bit.address + 3)
    return lambda: cpu.hook_del(hook)


def stuck(cpu: Uc, bit: Bit, value: int) -> Callable[[], None]:
    """Let the bit always be read as `value`. What is returned mends it."""
    return _before_reads(cpu, bit, lambda: bit.put(cpu, value))


def no_transition(cpu: Uc, bit: Bit, to: int) -> None:
    """Forbid a bit to change to `to` once it is the other."""
    keeps = False

    def written(old: int, new: int) -> None:
        nonlocal keeps
        keeps = new == to and (old != to or keeps)

    _at_writes(cpu, bit, written)
    _before_reads(cpu, bit, lambda: bit.put(cpu, 1 - to) if keeps else None)


def coupled(cpu: Uc, aggressor: Bit, victim: Bit, rises: bool, becomes: int | None) -> None:
    """When the aggressor rises (or falls) the victim becomes 0 or 1, or with None is inverted; a change that the same
    write makes to the victim comes first."""
    struck = False

    def written(old: int, new: int) -> None:
        nonlocal struck
        struck = struck or (old, new) == ((0, 1) if rises else (1, 0))

    def spoil() -> None:
        nonlocal struck
        if struck:
            victim.put(cpu, 1 - victim.get(cpu) if becomes is None else becomes)
        struck = False

    def overwritten(_old: int, _new: int) -> None:
        nonlocal struck
        struck = False

    if victim.address != aggressor.address:
        _at_writes(cpu, victim, overwritten)
    _at_writes(cpu, aggressor, written)
    _before_reads(cpu, victim, spoil)
