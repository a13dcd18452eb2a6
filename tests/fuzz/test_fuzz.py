"""A short run of every fuzz target finds nothing, and the fuzzers find what was put there for them to find.

What is run here is what there is time for; `python -m fuzz` and the workflow `evidence` go on for longer."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import NamedTuple

import pytest
from fuzz import libfuzzer

RUNS = {"app": 250, "slcan": 80_000, "candump": 15_000, "settings": 15_000, "aircraft": 30_000}
"""Of each target, at most two seconds."""
SEED = "-seed=1"
SECONDS = int(os.environ.get("LEVER_FUZZ_SECONDS", "0"))
"""Of each target, beyond those."""


class Fault(NamedTuple):
    """What is replaced by what in a source of a target."""

    target: str
    path: str
    right: str
    wrong: str


SLCAN, LINUX = "firmware/port/slcan/slcan.c", "firmware/port/linux"
CANDUMP = "host_tools/lever_cdkf/firmware/c/candump.c"
FAULTS = {
    "a line that overflows": Fault(
        "slcan", SLCAN, "((uint32_t)SLCAN_LINE_BYTES - 1u)", "((uint32_t)SLCAN_LINE_BYTES + 8u)"
    ),
    "frames on a channel that listens": Fault(
        "slcan",
        SLCAN,
        "if ((slcan->channel == (uint8_t)SLCAN_CHANNEL_OPEN) &&",
        "if ((slcan->channel != (uint8_t)SLCAN_CHANNEL_CLOSED) &&",
    ),
    "lengths of nine": Fault("slcan", SLCAN, "(length > (uint32_t)DATA_BYTES)", "(length > (uint32_t)DATA_BYTES + 1u)"),
    "an answer that is missing": Fault("slcan", SLCAN, "answer(slcan, false); /* hosts do not send it */", ""),
    "NaN taken for a measurement": Fault(
        "app", "firmware/app/estimator.c", "valid && (fabsf(value) <= most)", "valid && !(fabsf(value) > most)"
    ),
    "torque without a limit": Fault(
        "app", "firmware/app/torque_gate.c", "clamped(gate->gain * asked, gate->limit)", "(gate->gain * asked)"
    ),
    "torque that stays in silence": Fault(
        "app", "firmware/app/torque_gate.c", "gate->output_left = time_left(gate->output_left, elapsed_us);", ""
    ),
    "a counter that stands": Fault(
        "app", "firmware/app/link.c", "(uint8_t)((link->counter[output] + 1u) & 15u)", "link->counter[output]"
    ),
    "a mode that a reset does not leave": Fault(
        "app", "firmware/app/estimator.c", "estimator->frozen = false;\n    estimator->last", "estimator->last"
    ),
    "a name that does not fit": Fault(
        "candump", CANDUMP, "(length >= (size_t)BULK_BUS_NAME)", "(length > (size_t)BULK_BUS_NAME)"
    ),
    "an identifier with a flag in it": Fault(
        "candump", CANDUMP, "frame->id = value & EXTENDED_MASK;", "frame->id = value;"
    ),
    "a settings line that overflows": Fault(
        "settings", f"{LINUX}/settings.c", "(sizeof line->text - 1u)", "(sizeof line->text + 8u)"
    ),
    "a setting out of range": Fault("settings", f"{LINUX}/settings.c", "(rounded <= setting->greatest)", "true"),
    "a number beyond those of float": Fault(
        "aircraft", f"{LINUX}/aircraft.c", "good = isfinite(numbers[i]);", "good = true;"
    ),
    "a point too many": Fault(
        "aircraft",
        f"{LINUX}/aircraft.c",
        "aircraft->count < (uint8_t)LEVER_AIRCRAFT_POINTS",
        "aircraft->count <= (uint8_t)LEVER_AIRCRAFT_POINTS",
    ),
}
pytestmark = pytest.mark.requires(libfuzzer.COMPILERS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all tests build, so that each source is compiled once."""
    return tmp_path_factory.mktemp("fuzz")


def build(name: str, folder: Path, *replaced: tuple[str, Path]) -> Path:
    try:
        return libfuzzer.build(name, folder, replaced)
    except libfuzzer.FuzzError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", libfuzzer.SOURCES)
def test_nothing_is_found(name: str, folder: Path) -> None:
    result = libfuzzer.run(build(name, folder), folder / f"{name}.corpus", [SEED, f"-runs={RUNS[name]}"])
    assert not result.found, result.text[-4000:]
    assert result.count("number_of_executed_units") >= RUNS[name]
    if SECONDS:
        seed = f"-seed={secrets.randbelow(1 << 31)}"
        longer = libfuzzer.run(folder / name, folder / f"{name}.corpus", [seed, f"-max_total_time={SECONDS}"])
        assert not longer.found, f"{seed}\n{longer.text[-4000:]}"


@pytest.mark.parametrize("name", FAULTS)
def test_a_seeded_fault_is_found(name: str, folder: Path, tmp_path: Path) -> None:
    fault = FAULTS[name]
    source = (libfuzzer.ROOT / fault.path).read_text(encoding="utf-8")
    assert source.count(fault.right) == 1
    mutant = tmp_path / "mutant.c"
    mutant.write_text(source.replace(fault.right, fault.wrong), encoding="utf-8")
    program = build(fault.target, folder, (fault.path, mutant))
    assert libfuzzer.run(program, tmp_path / "corpus", [SEED, f"-runs={8 * RUNS[fault.target]}"]).found
