"""`lever qemu` without QEMU: what is said of one that does not run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from lever_cdkf.board import qemu
from python.conftest import Refused


@pytest.mark.parametrize(
    ("says", "shown"), [("unsupported machine type", "unsupported machine type"), ("", "it does not say why")]
)
def test_a_qemu_that_ends_at_once_is_told_with_what_it_says(
    says: str, shown: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, refused: Refused
) -> None:
    image, program = tmp_path / "some.elf", tmp_path / qemu.PROGRAM
    image.write_bytes(b"\x7fELF\x01\x01".ljust(18, b"\0") + b"\x28\x00")
    program.write_text(f"#!/bin/sh\nprintf '{says}\n' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert refused("qemu", image) == f"lever: error: {qemu.PROGRAM} has ended: {shown}\n"


def test_one_processor_is_one_of_those_that_the_thread_may_use() -> None:
    """And afterwards it may use the same as before."""
    everything = os.sched_getaffinity(0)
    try:
        for allowed in (everything, {max(everything)}):
            os.sched_setaffinity(0, allowed)
            with qemu.one_processor():
                inside = os.sched_getaffinity(0)
            assert len(inside) == 1
            assert inside <= allowed == os.sched_getaffinity(0)
    finally:
        os.sched_setaffinity(0, everything)
