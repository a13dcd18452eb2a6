"""Cycles of a Cortex-M4F by a model without wait states, after its TRM (DDI 0439), 3.3 and 7.2.3, simplified.

Not modelled: loads in a row that overlap, stores that wait for the bus, targets of branches that are not aligned, and
conditional instructions that are skipped, which count as executed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

TAKEN = 2
_USED_AT_ONCE = 1
_CONDITION = "(?:eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)?"
_ACCUMULATE = re.compile(rf"v(?:n?ml[as]|fn?m[as]){_CONDITION}\.f32")
_DIVIDE = re.compile(rf"v(?:div|sqrt){_CONDITION}\.f32")
_ONE_OPERATION = re.compile(rf"v(?:add|sub|n?mul|div|sqrt){_CONDITION}\.f32")
_INTEGER_DIVIDE = re.compile("[us]div")
_LOAD = re.compile("v?ldr(?!d)|tb[bh]")
_SEVERAL = re.compile("v?(?:ldm|stm|push|pop)|(?:ldr|str)d")
_READS_ALL = re.compile(r"v(?:cmp|str|stm|push)")
_REGISTER = re.compile(r"\b([sd])(\d+)(?:-[sd](\d+))?")

MODEL = {
    "vdiv, vsqrt": 14,
    "vmla, vfma and their like": 3,
    "load, tbb, tbh": 2,
    "transfer of n registers (ldm, stm, vldm, vstm, push, pop, ldrd, strd)": "1 + n",
    "udiv, sdiv": 12,
    "any other, stores too": 1,
    "a branch that is taken, besides": TAKEN,
    "a float that is computed or loaded and used by the next instruction, besides": _USED_AT_ONCE,
}
"""The model, as it is printed."""


@dataclass(frozen=True)
class Instruction:
    """A line of the disassembly."""

    mnemonic: str
    operands: str

    @property
    def operations(self) -> int:
        """Floating-point operations: additions, multiplications, divisions, square roots; two in a multiply-accumulate.
        Comparisons, conversions, moves and changes of sign are none."""
        return 2 if _ACCUMULATE.match(self.mnemonic) else int(bool(_ONE_OPERATION.match(self.mnemonic)))

    @property
    def cycles(self) -> int:
        """Of the instruction by itself; a branch is not taken."""
        if _SEVERAL.match(self.mnemonic):
            return 1 + _words(self)
        for pattern, cycles in ((_DIVIDE, 14), (_ACCUMULATE, 3), (_LOAD, 2), (_INTEGER_DIVIDE, 12)):
            if pattern.match(self.mnemonic):
                return cycles
        return 1

    @property
    def result(self) -> int:
        """Float registers with a result that comes a cycle late, one bit each."""
        is_late = self.operations > 0 or self.mnemonic.startswith("vldr")
        return _bits(self.operands.partition(",")[0]) if is_late else 0

    @property
    def sources(self) -> int:
        """Float registers that it reads, one bit each."""
        if _READS_ALL.match(self.mnemonic) or _ACCUMULATE.match(self.mnemonic):
            return _bits(self.operands)
        return _bits(self.operands.partition(",")[2])


def _words(transfer: Instruction) -> int:
    """Register in its list, a double one for two; ldrd and strd have no list, but two registers."""
    registers = transfer.operands.partition("{")[2]
    return _bits(registers).bit_count() or registers.count(",") + 1 if registers else 2


def _bits(operands: str) -> int:
    """Return the float registers named in it: bit n is s<n>; d<n> is a pair of them."""
    bits = 0
    for kind, first, last in _REGISTER.findall(operands):
        width = 2 if kind == "d" else 1
        begin, end = int(first) * width, (int(last or first) + 1) * width
        bits |= (1 << end) - (1 << begin)
    return bits


def of_block(block: Sequence[Instruction], after: Instruction, is_jump: bool) -> list[int]:
    """Return the of block of each instruction in a block of straight code, which goes on, or jumps, to the
    instruction `after`: a wait counts where the result comes from, a jump at the branch."""
    spent = [each.cycles for each in block]
    for place, (each, following) in enumerate(zip(block, [*block[1:], after], strict=True)):
        spent[place] += _USED_AT_ONCE if each.result & following.sources else 0
    spent[-1] += TAKEN if is_jump else 0
    return spent
