"""The places themselves: a command in User-Mode Linux behaves as one that is run here, and leaves nothing behind."""

from __future__ import annotations

import io
import os
import subprocess
from pathlib import Path

import pytest
from vcan import uml

pytestmark = pytest.mark.outside


@pytest.fixture(autouse=True)
def _machine() -> None:
    try:
        uml.find_machine()
    except uml.UmlError as error:
        pytest.skip(str(error))


def processes() -> int:
    """Process of User-Mode Linux machines that were started from this process."""
    listed = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    return listed.count(f"/lever-uml-{os.getpid()}-")


def test_output_and_exit_status_are_those_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LEVER_TEST_WORD", "a 'quoted' $word")
    script = 'cat in; echo "$LEVER_TEST_WORD" >&2; ip -brief link show vcan0 >out; sleep 1000 & exit 7'
    (tmp_path / "in").write_bytes(b"one\r\n\ntwo")
    stdout, stderr = io.BytesIO(), io.BytesIO()
    status = uml.run(["sh", "-c", script], stdout=stdout, stderr=stderr, time_limit_s=60.0)
    assert status == 7
    assert stdout.getvalue() == b"one\r\n\ntwo"
    assert stderr.getvalue() == b"a 'quoted' $word\n"
    assert "UP" in (tmp_path / "out").read_text()
    assert processes() == 0
