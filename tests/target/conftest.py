"""The images for the STM32F405, which the build has made (target stm32f4 of tests/CMakeLists.txt)."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest


def image(build_dir: Path, transport: str) -> Path:
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("no arm-none-eabi-gcc here: apt install gcc-arm-none-eabi libnewlib-arm-none-eabi")
    path = build_dir / f"stm32f4/lever_stm32f4_{transport}.elf"
    assert path.is_file(), f"{path} is not there: cmake --build {build_dir} --target stm32f4"
    return path


@pytest.fixture(scope="session")
def can_image(build_dir: Path) -> Path:
    """The image whose frames travel over bxCAN; .bin, .hex and .map are beside it."""
    return image(build_dir, "can")


@pytest.fixture(scope="session")
def slcan_image(build_dir: Path) -> Path:
    """The image whose frames travel as SLCAN over USART1; .bin, .hex and .map are beside it."""
    return image(build_dir, "slcan")
