"""The port that stands on the porting guide: its three files, built by its commands, on an emulated Cortex-M7."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import readmes

ESTIMATES = re.compile(r" (21[0-3]#[0-9A-F]{16}) R$", re.MULTILINE)
"""STATE_ESTIMATE, PILOT_PARAMETERS, PILOT_SIGMA, PILOT_DYNAMICS in bus.log."""

pytestmark = pytest.mark.requires("arm-none-eabi-gcc", "qemu-system-arm")


def run(command: str, folder: Path) -> None:
    place = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(shlex.split(command), cwd=folder, env=place, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    assert "warning" not in done.stdout + done.stderr


def test_the_port_for_a_cortex_m7_estimates_as_this_process(root: Path, tmp_path: Path) -> None:
    guide = root / "firmware/port/PORTING.md"
    sources = [text for text in readmes.blocks(guide, "c").values() if "vectors" in text]
    texts = [*sources, *readmes.blocks(guide, "cmake").values()]
    for name, text in zip(("main.c", "CMakeLists.txt", "toolchain.cmake"), texts, strict=True):
        (tmp_path / name).write_text(text, encoding="utf-8")
    (script,) = (text for text in readmes.blocks(guide, "console").values() if "lever qemu" in text)
    commands = script.replace("\\\n", "").replace("SOURCES", str(root)).strip().splitlines()
    assert len(commands) == 3
    for command in (*commands, 'lever sim base_only --set duration="2 s" --out here'):
        run(command, tmp_path)
    there, here = (ESTIMATES.findall((tmp_path / name / "bus.log").read_text()) for name in ("there", "here"))
    assert len(here) == 2300
    assert there == here
