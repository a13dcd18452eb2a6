"""A short run of every fuzz target finds nothing, and the fuzzers find what was put there for them to find."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz import libfuzzer

RUNS = 200_000
SEED = "-seed=1"
SEEDED = {
    "a line that overflows": ("((uint32_t)SLCAN_LINE_BYTES - 1u)", "((uint32_t)SLCAN_LINE_BYTES + 8u)"),
    "frames on a channel that listens": (
        "if ((slcan->channel == (uint8_t)SLCAN_CHANNEL_OPEN) &&",
        "if ((slcan->channel != (uint8_t)SLCAN_CHANNEL_CLOSED) &&",
    ),
    "lengths of nine": ("(length > (uint32_t)DATA_BYTES)", "(length > (uint32_t)DATA_BYTES + 1u)"),
    "an answer that is missing": ("answer(slcan, false); /* hosts do not send it */", ""),
}
"""Faults in slcan.c: what is replaced by what."""


def build(name: str, folder: Path, *sources: Path) -> Path:
    try:
        return libfuzzer.build(name, folder, sources)
    except libfuzzer.FuzzError as error:
        pytest.skip(str(error))


@pytest.mark.requires(libfuzzer.COMPILERS)
@pytest.mark.parametrize("name", libfuzzer.SOURCES)
def test_nothing_is_found(name: str, tmp_path: Path) -> None:
    result = libfuzzer.run(build(name, tmp_path), tmp_path / "corpus", [SEED, f"-runs={RUNS}"])
    assert not result.found, result.text[-4000:]
    assert f"stat::number_of_executed_units: {RUNS}" in result.text


@pytest.mark.requires(libfuzzer.COMPILERS)
@pytest.mark.parametrize("fault", SEEDED)
def test_a_seeded_fault_is_found(fault: str, tmp_path: Path) -> None:
    right, wrong = SEEDED[fault]
    source = (libfuzzer.FIRMWARE / "port/slcan/slcan.c").read_text(encoding="utf-8")
    assert source.count(right) == 1
    mutant = tmp_path / "mutant.c"
    mutant.write_text(source.replace(right, wrong), encoding="utf-8")
    result = libfuzzer.run(build("slcan", tmp_path, mutant), tmp_path / "corpus", [SEED, f"-runs={RUNS}"])
    assert result.found
