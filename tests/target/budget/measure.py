"""The measurements put together: what budget.json holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.host_tools.library import enum_names, lib
from numpy.typing import NDArray

from . import image, sizes
from .image import ESTIMATORS, FORMS, Run
from .recording import MODELS, Recording, record

START_UP_S = 2.0
"""Until then the estimator starts up: it aligns, dither fades in, caution_time passes. Counted by itself."""
_RUNNING = next(code for code, name in enum_names("lever_mode").items() if name == "run")

Case = tuple[str, str, str]
"""Estimator, model, and one of FORMS."""


@dataclass(frozen=True)
class Count:
    """Instructions over a recording, in mode run after START_UP_S, and before that."""

    mean: float
    median: float
    worst: int
    worst_s: float
    """When [s]."""
    start_up_worst: int

    @staticmethod
    def of(instructions: NDArray[np.int64], time: NDArray[np.float64], running: NDArray[np.bool_]) -> Count:
        """Of a value for each sample, at the times [s]."""
        steady = running & (time >= START_UP_S)
        counted = instructions[steady]
        return Count(
            mean=round(float(counted.mean()), 1),
            median=float(np.median(counted)),
            worst=int(counted.max()),
            worst_s=float(time[steady][counted.argmax()]),
            start_up_worst=int(instructions[time < START_UP_S].max()),
        )


def times(recording: Recording) -> NDArray[np.float64]:
    """Of the samples [s]."""
    return recording.samples["time_us"].astype(np.float64) * 1e-6


def run_all(elf: Path, tell: Callable[[int, int, str], None]) -> dict[Case, Run]:
    """The image over every case; `tell` is called with the runs done, all runs, and the last one's name."""
    cases = [(estimator, model, form) for form in FORMS for estimator in ESTIMATORS for model in MODELS]
    runs = {}
    for done, case in enumerate(cases):
        tell(done, len(cases), " ".join(case))
        estimator, model, form = case
        runs[case] = image.run(elf, record(model), model, estimator, form)
    return runs


def count(run: Run, model: str) -> Count:
    """Instructions of a run."""
    return Count.of(run.instructions, times(record(model)), run.mode == _RUNNING)


def budget(elf: Path, runs: dict[Case, Run]) -> dict[str, Any]:
    """What budget.json holds."""
    instructions: dict[str, Any] = {"tick": {}}
    for (estimator, model, form), run in runs.items():
        place = instructions["tick"] if form == "tick" else instructions
        place.setdefault(estimator, {})[model] = vars(count(run, model))
    library = sizes.of_library(elf)
    return {
        "processor": "Cortex-M4F: QEMU's netduinoplus2 (STM32F405)",
        "compiler": image.compiler(),
        "overhead_instructions": max(run.overhead for run in runs.values()),
        "instructions": instructions,
        "text_bytes": library["text"] + library["rodata"],
        "code_bytes": library["text"],
        "rodata_bytes": library["rodata"],
        "data_bytes": library["data"],
        "bss_bytes": library["bss"],
        "instance_bytes": sizes.of_instance(elf),
        "memory_bytes": int(lib.LEVER_MEMORY_BYTES),
        "stack_painted_bytes": max(int(run.stack.max()) for run in runs.values()),
    }
