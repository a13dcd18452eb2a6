"""The examples of host_tools/README.md, as they stand there."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import can
import pytest
import readmes

pytestmark = pytest.mark.usefixtures("installed")


def blocks(root: Path, language: str) -> list[str]:
    return list(readmes.blocks(root / "host_tools/README.md", language).values())


def test_python(root: Path, tmp_path: Path) -> None:
    with_bus, without, _ = blocks(root, "python")
    done = subprocess.run([sys.executable, "-c", with_bus], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0.199 s STATE_ESTIMATE {" in done.stdout
    assert "PILOT_PARAMETERS {" in done.stdout
    done = subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^\d\.\d\d Hz, damping ratio \d\.\d\d$", done.stdout, re.MULTILINE)


def test_shell(
    root: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    samples: Callable[[int, int], list[tuple[tuple[int, bytes], tuple[int, bytes]]]],
) -> None:
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    with can.CanutilsLogWriter(tmp_path / "session.log", channel="vcan0") as writer:
        for identifier, data in samples(0, 1)[0]:
            writer.on_message_received(can.Message(arbitration_id=identifier, is_extended_id=False, data=data))
    commands = "".join(blocks(root, "sh")).splitlines()
    assert len(commands) == 10
    for command in commands:
        done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert (tmp_path / "my.json").is_file()
