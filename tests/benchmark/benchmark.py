"""lever_update() on this machine: nanoseconds by the clock, instructions by valgrind's callgrind."""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.library import enum_names
from target.budget.recording import MODELS, Recording, record

ESTIMATORS = ("dual", "joint")
LIMIT_NS = 1000.0
"""A dual step with the lever model: what was promised."""

_ROUNDS = 20
_COUNTED = 4000
"""Samples under callgrind, which is 50 times slower."""
_TOTAL = re.compile(r"^(?:summary|totals): (\d+)", re.MULTILINE)


@dataclass(frozen=True)
class Result:
    """Of one call of lever_update(), in the mean over a recording."""

    estimator: str
    model: str
    best_ns: float
    """Of all rounds: what the call takes when nothing else does."""
    median_ns: float
    instructions: float | None
    """None without valgrind."""


def measure(program: Path, estimator: str, model: str, valgrind: str | None) -> Result:
    """Run the program over the recording of a model. Raise LeverError."""
    recording = record(model)
    with tempfile.TemporaryDirectory(prefix="lever-benchmark-") as name:
        folder = Path(name)
        (folder / "samples").write_bytes(recording.samples.tobytes())
        (folder / "few").write_bytes(recording.samples[:_COUNTED].tobytes())
        words = _arguments(recording, model, estimator)
        rounds = _run([str(program), str(folder / "samples"), str(_ROUNDS), *words])
        times = np.array([float(line) for line in rounds.split()])
        counted = None
        if valgrind is not None:
            output = folder / "callgrind"
            tool = [valgrind, "--tool=callgrind", "--toggle-collect=lever_update", f"--callgrind-out-file={output}"]
            _run([*tool, str(program), str(folder / "few"), "1", *words])
            counted = _instructions(output.read_text(encoding="utf-8")) / _COUNTED
        return Result(estimator, model, float(times.min()), float(np.median(times)), counted)


def _arguments(recording: Recording, model: str, estimator: str) -> list[str]:
    codes = {"model": ("lever_model", model), "estimator": ("lever_estimator", estimator)}
    choices = [f"{key}={list(enum_names(enum).values()).index(name)}" for key, (enum, name) in codes.items()]
    settings = [f"{name}={value!r}" for name, value in (recording.scenario.settings or {}).items()]
    return [*choices, *settings, f"dither_rms={recording.dither_rms!r}"]


def _instructions(text: str) -> int:
    match = _TOTAL.search(text)
    if match is None or int(match[1]) == 0:
        raise LeverError("callgrind has counted nothing: was lever_update() inlined?")
    return int(match[1])


def _run(command: list[str]) -> str:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise LeverError(f"{command[0]} failed: {(result.stderr.strip() or 'without a word').splitlines()[-1]}")
    return result.stdout


def cases() -> list[tuple[str, str]]:
    """Estimator and model of each."""
    return [(estimator, model) for estimator in ESTIMATORS for model in MODELS]
