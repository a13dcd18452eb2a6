"""`budget images`: builds the images that the tests of this folder run, before them."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from . import image


def run(args: argparse.Namespace) -> int:
    """Return the command; without the cross compiler it does nothing, and the tests are skipped. Raise LeverError."""
    if shutil.which(image.tool("gcc")) is None:
        print(f"no {image.tool('gcc')}: tests of the budget are skipped")
        return 0
    folder: Path = args.build
    image.build(folder)
    image.build(folder.with_name("soft_float"), processor="-mcpu=cortex-m4 -mthumb -mfloat-abi=soft")
    image.build(folder.with_name("dearer"), _dearer_firmware(folder.with_name("dearer_firmware")))
    return 0


def _dearer_firmware(folder: Path) -> Path:
    """Return a copy of the firmware in which each step fills a buffer of 1600 bytes."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(image.FIRMWARE, folder)
    source = folder / "app/estimator.c"
    text = source.read_text(encoding="utf-8")
    before, brace, _ = text.partition("enum lever_mode estimator_update(")[2].partition("{")
    waste = "volatile float waste[400]; for (uint32_t i = 0u; i < 400u; i++) { waste[i] = 1.0f; }"
    source.write_text(text.replace(f"{before}{brace}", f"{before}{brace}{waste}", 1), encoding="utf-8")
    return folder
