"""The model of cycles on short sequences that were counted by hand."""

from __future__ import annotations

from pathlib import Path

import pytest
from target.budget import trace
from target.budget.cycles import Instruction, of_block
from target.budget.recording import record

RETURN = Instruction("bx", "lr")


def instructions(text: str) -> list[Instruction]:
    """Return one a line: mnemonic, then operands."""
    parts = [line.strip().partition(" ") for line in text.strip().splitlines()]
    return [Instruction(mnemonic, operands.strip()) for mnemonic, _, operands in parts]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("vadd.f32 s0, s1, s2\nvmul.f32 s3, s4, s5\nvsub.f32 s6, s7, s8", [1, 1, 1]),
        ("vadd.f32 s0, s1, s2\nvmul.f32 s3, s0, s5", [2, 1]),
        ("vadd.f32 s0, s1, s2\nmov r0, r1\nvmul.f32 s3, s0, s5", [1, 1, 1]),
        ("vadd.f32 s0, s1, s2\nvmul.f32 s0, s1, s5", [1, 1]),
        ("vmul.f32 s0, s1, s2\nvmla.f32 s0, s4, s5\nvstr s0, [r0, #4]", [2, 4, 1]),
        ("vdiv.f32 s0, s1, s2\nvsqrt.f32 s3, s0\nvcmpe.f32 s3, #0.0\nvmrs APSR_nzcv, fpscr", [15, 15, 1, 1]),
        ("vdivgt.f32 s0, s1, s2\nvfma.f32 s3, s4, s5\nvnmls.f32 s6, s7, s8", [14, 3, 3]),
        ("vldr s0, [r1, #4]\nvadd.f32 s1, s0, s0", [3, 1]),
        ("vldr s0, [r1, #4]\nvldr s2, [r1, #8]\nvadd.f32 s1, s0, s0", [2, 2, 1]),
        ("ldr.w r0, [r1, #4]\nadd r0, r0, #1\nstr r0, [r1]\nldrb r2, [r0]\nstrh r2, [r0]", [2, 1, 1, 2, 1]),
        ("push {r4, r5, r6, lr}\nvpush {d8-d9}\nvldmia r1!, {s0-s2}\nldmia.w r0, {sl, fp}", [5, 5, 4, 3]),
        ("ldrd r0, r1, [sp]\nstrd r0, r1, [sp]\nudiv r0, r1, r2\nmla r0, r1, r2, r3", [3, 3, 12, 1]),
        ("it gt\nvmovgt.f32 s0, s1\ncmp r0, #1", [1, 1, 1]),
    ],
)
def test_straight_code(text: str, expected: list[int]) -> None:
    assert of_block(instructions(text), RETURN, is_jump=False) == expected


def test_end_of_a_block() -> None:
    """A branch that is taken, a table branch, a return by pop; a result that the next block uses at once."""
    for text, expected in (("cmp r0, #1\nbne.n 8000", [1, 3]), ("tbb [pc, r3]", [4]), ("pop {r4, pc}", [5])):
        assert of_block(instructions(text), RETURN, is_jump=True) == expected
    (user,) = instructions("vadd.f32 s1, s0, s0")
    assert of_block(instructions("vmul.f32 s0, s1, s2"), user, is_jump=False) == [2]


@pytest.mark.requires("arm-none-eabi-gcc")
def test_a_loop_in_the_image(elf: Path) -> None:
    """The one it is calibrated with: 100,000 times a subtraction and a branch, which is taken all but once."""
    traced = trace.trace(elf, record("lever"), "lever", "dual", "update", trace.LOOP, trace.LOOP)
    assert traced.instructions.tolist() == [200_000]
    assert traced.cycles.tolist() == [100_000 * (1 + 1 + 2) - 2]
