"""The RAM test of the image, as a function, on memory with one fault each: every kind that it claims is found."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from target.bxcan import memory
from target.bxcan.elf import FLASH, Image
from target.bxcan.memory import Bit
from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm

RAM, SLICE, STACK = 0x2000_0000, 0x2000_1000, 0x2000_0800
WORDS = 8
BACKGROUNDS = range(6)
CONTENTS = struct.pack("<8I", *(random.Random(3).getrandbits(32) for _ in range(WORDS)))
RETURN = 0x2000_2000
PAIRS = 40
"""Of bits that are coupled, drawn at random."""


class March:
    """The functions of the image in a processor of their own, with a slice of RAM."""

    def __init__(self, elf: Path) -> None:
        self.image = Image(elf)

    def call(self, cpu: Uc, function: str, *arguments: int) -> int:
        for number, argument in enumerate(arguments):
            cpu.reg_write(arm.UC_ARM_REG_R0 + number, argument)
        cpu.reg_write(arm.UC_ARM_REG_SP, STACK)
        cpu.reg_write(arm.UC_ARM_REG_LR, RETURN | 1)
        cpu.emu_start(self.image.symbols[function] | 1, RETURN)
        return int(cpu.reg_read(arm.UC_ARM_REG_R0))

    def finds(self, spoil: Callable[[Uc], object]) -> bool:
        """Return whether some background finds what is wrong with the memory."""
        cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        cpu.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        cpu.mem_map(FLASH, 1 << 20)
        cpu.mem_map(RAM, 128 << 10)
        cpu.mem_write(FLASH, self.image.flash)
        cpu.mem_write(SLICE, CONTENTS)
        spoil(cpu)
        for number in BACKGROUNDS:
            background = self.call(cpu, "ram_test_background", number)
            if not self.call(cpu, "ram_test_slice", SLICE, background) & 0xFF:
                return True
        assert cpu.mem_read(SLICE, len(CONTENTS)) == CONTENTS, "the contents have changed"
        return False


@pytest.fixture(scope="module")
def march(can_image: Path) -> March:
    return March(can_image)


def bits(count: int) -> list[Bit]:
    """Return the first and the last, and others."""
    draw = random.Random(1)
    chosen = [Bit(SLICE, 0), Bit(SLICE + 4 * (WORDS - 1), 31)]
    return chosen + [Bit(SLICE + 4 * draw.randrange(WORDS), draw.randrange(32)) for _ in range(count)]


def test_sound_memory_passes_and_keeps_its_contents(march: March) -> None:
    assert not march.finds(lambda cpu: None)


def test_no_two_bits_of_a_word_are_alike_in_all_backgrounds(march: March) -> None:
    cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
    cpu.mem_map(FLASH, 1 << 20)
    cpu.mem_map(RAM, 128 << 10)
    cpu.mem_write(FLASH, march.image.flash)
    words = [march.call(cpu, "ram_test_background", number) for number in BACKGROUNDS]
    assert len({tuple(word >> bit & 1 for word in words) for bit in range(32)}) == 32


@pytest.mark.parametrize("value", [0, 1])
@pytest.mark.requirement("R45")
def test_stuck_bit_is_found(march: March, value: int) -> None:
    for bit in bits(PAIRS):
        assert march.finds(partial(memory.stuck, bit=bit, value=value)), bit


@pytest.mark.parametrize("to", [0, 1])
def test_bit_that_cannot_change_is_found(march: March, to: int) -> None:
    for bit in bits(PAIRS):
        assert march.finds(partial(memory.no_transition, bit=bit, to=to)), bit


@pytest.mark.parametrize("rises", [True, False])
@pytest.mark.parametrize("becomes", [None, 0, 1])
def test_bit_that_changes_with_another_is_found(march: March, rises: bool, becomes: int | None) -> None:
    for aggressor, victim in zip(bits(PAIRS), reversed(bits(PAIRS)), strict=True):
        if aggressor.address != victim.address:
            pair = {"aggressor": aggressor, "victim": victim}
            assert march.finds(partial(memory.coupled, **pair, rises=rises, becomes=becomes)), pair


@pytest.mark.parametrize("value", [0, 1])
def test_contents_survive_where_the_place_to_keep_them_is_broken(march: March, value: int) -> None:
    """finds() looks at them where nothing is found; here they are to be right in any case."""
    results = []
    for word in range(1, 64):
        bit = Bit(STACK - 4 * word, 7)
        cpus: list[Uc] = []

        def spoil(cpu: Uc, bit: Bit = bit, cpus: list[Uc] = cpus) -> None:
            cpus.append(cpu)
            memory.stuck(cpu, bit, value)

        try:
            results.append(march.finds(spoil))
        except UcError:  # the place of a return address
            continue
        assert cpus[0].mem_read(SLICE, len(CONTENTS)) == CONTENTS
    assert any(results)
