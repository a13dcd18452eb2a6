"""The image on QEMU's STM32F405: starts, tests itself, and says truly what is wrong with its machine."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from target.stm32f4 import elf
from target.stm32f4.board import ANSWER_TIME, Debugger, running

pytestmark = pytest.mark.requires("qemu-system-arm", "arm-none-eabi-gcc")

CLOCK, ROM, SELF_TEST, HARD_FAULT = 1, 2, 4, 16
"""Bits of enum lever_platform_fault (lever_cdkf.h)."""
BY_HARD_FAULT, BY_STACK_OVERFLOW = 6, 7
"""Of enum message_cause (can/messages.h)."""
SP, PC = 13, 15
NOWHERE = 0x6000_0000
"""External memory, of which there is none."""
FAULT_SEEN = 0x5EE4_FA17


def faults_of(image: Path, folder: Path) -> float:
    with running(image, folder) as board:
        board.wait_for_answer()
        return board.platform_health()["faults"]


def go_on_until(condition: Callable[[], bool], debugger: Debugger) -> None:
    """Let the core run, a moment at a time, until something has become true of its memory."""
    end = time.monotonic() + ANSWER_TIME
    while not condition():
        assert time.monotonic() < end
        debugger.go_on()
        time.sleep(0.05)
        debugger.stop()


@pytest.mark.requirement("R45")
def test_starts_and_passes_its_self_tests(slcan_image: Path, tmp_path: Path) -> None:
    """QEMU has no crystal, which the image is to notice; and nothing else is wrong."""
    with running(slcan_image, tmp_path) as board:
        board.wait_for_answer()
        assert board.command("N") == "NF405"
        health = board.platform_health()
        assert health["faults"] == CLOCK
        assert {health[name] for name in ("overruns", "dropped", "bus_offs")} == {0}


def test_image_for_can_goes_round_without_a_controller_that_answers(can_image: Path, tmp_path: Path) -> None:
    tested, milliseconds = (elf.symbol(can_image, name) for name in ("lasting_faults", "milliseconds"))
    with running(can_image, tmp_path) as board, board.debugger() as debugger:
        go_on_until(lambda: debugger.words(milliseconds, 1)[0] >= 100, debugger)
        assert debugger.words(tested, 1)[0] & 0xFF == CLOCK


@pytest.mark.requirement("R45")
def test_rom_crc_finds_a_flipped_bit(slcan_image: Path, tmp_path: Path) -> None:
    """The bit is in the serial number, so that the image runs on and shows it."""
    flash = elf.flash_bytes(slcan_image)
    flash[flash.index(b"F405\0")] ^= 0x02
    damaged = tmp_path / "damaged.bin"
    damaged.write_bytes(flash)
    with running(damaged, tmp_path) as board:
        board.wait_for_answer()
        assert board.command("N") == "ND405"
        assert board.platform_health()["faults"] == CLOCK | ROM


@pytest.mark.requirement("R45")
def test_self_test_finds_a_wrong_instruction(slcan_image: Path, tmp_path: Path) -> None:
    """An addition in the filter has become a subtraction, with the CRC made good again."""
    flash = elf.flash_bytes(slcan_image)
    code = elf.instructions(slcan_image, "predict")
    address, encoding, _ = next(row for row in code if row[2].startswith("vadd.f32"))
    flash[address - elf.FLASH + 2] = encoding[2] | 0x40  # VADD to VSUB: ARMv7-M A7.7.225 and A7.7.260
    elf.put_crc(flash)
    damaged = tmp_path / "damaged.bin"
    damaged.write_bytes(flash)
    assert faults_of(damaged, tmp_path) == CLOCK | SELF_TEST


@pytest.mark.requirement("R46")
def test_hard_fault_is_recorded_and_reported_once(slcan_image: Path, tmp_path: Path) -> None:
    fault_last = elf.symbol(slcan_image, "fault_last")
    with ExitStack() as stack:
        board = stack.enter_context(running(slcan_image, tmp_path))
        board.wait_for_answer()
        debugger = stack.enter_context(board.debugger())
        debugger.write_register(PC, NOWHERE)
        debugger.go_on()
        board.wait_for_answer()
        health = board.platform_health()
        assert (health["faults"], health["cause"]) == (CLOCK | HARD_FAULT, BY_HARD_FAULT)
        assert health["fault_address"] == NOWHERE

        debugger.stop()
        mark, count, pc, _lr, _psr, cfsr, hfsr, _address = debugger.words(fault_last, 8)
        assert (mark, count, pc) == (FAULT_SEEN, 1, NOWHERE)
        assert cfsr & 0x100, "IBUSERR: an instruction that cannot be fetched"
        assert hfsr & 0x4000_0000, "FORCED: a fault that has become a hard one"
        debugger.write_register(PC, elf.symbol(slcan_image, "clock_failure_interrupt"))  # which resets
        milliseconds = elf.symbol(slcan_image, "milliseconds")
        (before,) = debugger.words(milliseconds, 1)
        go_on_until(lambda: debugger.words(milliseconds, 1)[0] < before, debugger)
        debugger.go_on()
        board.wait_for_answer()
        assert board.platform_health()["faults"] == CLOCK, "the last reset was not that of a fault"


@pytest.mark.requirement("R46")
def test_stack_overflow_is_a_hard_fault(slcan_image: Path, tmp_path: Path) -> None:
    """A stack that leaves RAM damages no data, and is recorded without what it would have held."""
    fault_last = elf.symbol(slcan_image, "fault_last")
    with ExitStack() as stack:
        board = stack.enter_context(running(slcan_image, tmp_path))
        board.wait_for_answer()
        debugger = stack.enter_context(board.debugger())
        debugger.write_register(SP, 0x2000_0010)
        debugger.go_on()
        board.wait_for_answer()
        health = board.platform_health()
        assert (health["faults"], health["cause"]) == (CLOCK | HARD_FAULT, BY_STACK_OVERFLOW)
        debugger.stop()
        _mark, count, pc, *_ = debugger.words(fault_last, 8)
        assert (count, pc) == (1, 0)
