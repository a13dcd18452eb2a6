"""What the examples of host_tools/README.md print; that all of them run is tested by tests/quality/test_readme.py."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import readmes

pytestmark = pytest.mark.usefixtures("installed")


def test_python(root: Path, tmp_path: Path) -> None:
    with_bus, without, *_ = readmes.blocks(root / "host_tools/README.md", "python").values()
    done = subprocess.run([sys.executable, "-c", with_bus], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0.199 s STATE_ESTIMATE {" in done.stdout
    assert "PILOT_PARAMETERS {" in done.stdout
    done = subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^\d\.\d\d Hz, damping ratio \d\.\d\d$", done.stdout, re.MULTILINE)
