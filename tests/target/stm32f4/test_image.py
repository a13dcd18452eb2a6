"""What can be told of the images without running them."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import zlib
from pathlib import Path

import pytest
from lever_cdkf.board.firmware_image import flash_contents
from target.stm32f4 import elf

SOURCES = Path(__file__).resolve().parents[3]
GOLDEN = SOURCES / "firmware/port/embedded/golden.py"
HEAP_AND_IO = {"malloc", "free", "calloc", "realloc", "_sbrk", "printf", "puts", "fopen", "_write", "exit"}
needs_compiler = pytest.mark.requires("arm-none-eabi-gcc")


def test_golden_vector_is_that_of_the_host() -> None:
    """golden.h, made anew, is the one that the images are built with."""
    spec = importlib.util.spec_from_file_location("golden", GOLDEN)
    assert spec is not None
    assert spec.loader is not None
    golden = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(golden)
    same = golden.header() == GOLDEN.with_name("golden.h").read_text(encoding="utf-8")
    assert same, f"the estimator computes other numbers now; if that is meant: build/venv/bin/python {GOLDEN}"


@needs_compiler
@pytest.mark.parametrize("transport", ["can", "slcan"])
def test_forms_are_alike_and_end_with_their_crc(transport: str, can_image: Path) -> None:
    image = can_image.with_name(f"lever_stm32f4_{transport}.elf")
    flash = flash_contents(image)
    assert flash == flash_contents(image.with_suffix(".hex")) == flash_contents(image.with_suffix(".bin"))
    assert zlib.crc32(flash[:-4]) == int.from_bytes(flash[-4:], "little")
    assert image.with_suffix(".map").is_file()


@needs_compiler
def test_starts_as_the_processor_expects(can_image: Path) -> None:
    """PM0214 2.3.4: the stack's top, then where to begin, with the lowest bit set for Thumb."""
    flash = elf.flash_bytes(can_image)
    stack, reset = (int.from_bytes(flash[at : at + 4], "little") for at in (0, 4))
    assert stack == elf.symbol(can_image, "image_stack_top") == 0x2000_0000 + 4096
    assert reset == elf.symbol(can_image, "reset_interrupt") | 1


@needs_compiler
@pytest.mark.parametrize("transport", ["can", "slcan"])
def test_no_heap_no_io_and_nothing_of_libc_but_two_functions(transport: str, can_image: Path) -> None:
    image = can_image.with_name(f"lever_stm32f4_{transport}.elf")
    names = {line.split()[-1] for line in elf.tool("nm", image).splitlines()}
    assert not names & HEAP_AND_IO
    placed = r"^ \.text\S*\s+0x0*80[0-9a-f]+\s+0x[0-9a-f]+ \S+lib[cm]\.a\(lib_a-(\w+)\.o\)"
    members = re.findall(placed, image.with_suffix(".map").read_text(), re.MULTILINE)
    assert set(members) == {"memcpy", "memset"}


@needs_compiler
@pytest.mark.parametrize(
    ("option", "source", "says"),
    [
        ("LEVER_STM32_HSE_MHZ=3", "clock.c", "the crystal has 4 to 26 MHz"),
        ("LEVER_STM32_BAUD=7000000", "usart.c", "not within 1 %"),
    ],
)
def test_impossible_clock_does_not_compile(option: str, source: str, says: str) -> None:
    flags = ("-std=c99", "-mcpu=cortex-m4", "-fsyntax-only", "-I", str(SOURCES / "firmware"), f"-D{option}")
    command = ["arm-none-eabi-gcc", *flags, str(SOURCES / "firmware/port/stm32f4" / source)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode != 0
    assert says in result.stderr
    fine = [argument for argument in command if not argument.startswith("-D")]
    assert subprocess.run(fine, capture_output=True, check=False).returncode == 0
