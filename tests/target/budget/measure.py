"""The measurements put together: what budget.json holds."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lever_cdkf.firmware.library import enum_names
from numpy.typing import NDArray

from . import cycles, image, sizes, stack, trace
from .image import ESTIMATORS, Run
from .recording import Recording, record

START_UP_S = 2.0
"""Until then the estimator starts up: it aligns, the dither fades in, caution_time passes. Counted by itself."""
GAP_S = (10.0, 10.4)
"""Where samples are left out, to see what the first one after a gap takes; less than gap_limit."""

Case = tuple[str, str, str]
"""Estimator, model, and one of FORMS."""
Tell = Callable[[int, int, str], None]
"""Told what is done, of how much, and what comes now."""


ON_A_DESKTOP = ("lever_state_restore",)
"""Functions of the façade that a controller must not call, as their comments say: their stack does not count."""


def _silent(done: int, total: int, what: str) -> None:
    """Nobody wants to know."""


_RUNNING = next(code for code, name in enum_names("lever_mode").items() if name == "run")
_FACADE = re.compile(r"^[a-z_][\w ]*[ *](lever_\w+)\(", re.MULTILINE)


@dataclass(frozen=True)
class Count:
    """Instructions or cycles a sample over a recording: in mode run after START_UP_S, and before that."""

    mean: float
    median: float
    worst: int
    worst_s: float
    """When [s]."""
    start_up_worst: int

    @staticmethod
    def of(spent: NDArray[np.int64], run: Run, time: NDArray[np.float64]) -> Count:
        """Of what each sample of a run took, at the times [s]."""
        steady = is_steady(run, time)
        counted = spent[steady]
        return Count(
            mean=round(float(counted.mean()), 1),
            median=float(np.median(counted)),
            worst=int(counted.max()),
            worst_s=float(time[steady][counted.argmax()]),
            start_up_worst=int(spent[time < START_UP_S].max()),
        )


def is_steady(run: Run, time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether each sample, at its time [s], is one of steady running."""
    steady: NDArray[np.bool_] = (run.mode == _RUNNING) & (time >= START_UP_S)
    return steady


def sample_times(recording: Recording) -> NDArray[np.float64]:
    """Return the sample times of a recording [s]."""
    return recording.samples["time_us"].astype(np.float64) * 1e-6


def facade(firmware: Path) -> list[str]:
    """Return the functions of lever_cdkf.h."""
    return _FACADE.findall((firmware / "lever_cdkf.h").read_text(encoding="utf-8"))


def run_all(elf: Path, tell: Tell = _silent) -> dict[Case, Run]:
    """Return the image in QEMU, over every case. Raise LeverError."""
    cases, runs = image.cases(), {}
    for done, (estimator, model, form) in enumerate(cases):
        tell(done, len(cases), f"{estimator} {model} {form} in QEMU")
        runs[estimator, model, form] = image.run(elf, record(model), model, estimator, form)
    return runs


def budget(elf: Path, firmware: Path, runs: dict[Case, Run], tell: Tell = _silent) -> dict[str, Any]:
    """Return what budget.json holds, of the runs of an image of this firmware. Raise LeverError."""
    return {
        "processor": "Cortex-M4F, as QEMU's netduinoplus2 has it",
        "compiler": image.compiler(),
        "calibration": _calibration(runs),
        "cycle_model": cycles.MODEL,
        **_spent(elf, runs, tell),
        "init": _init(elf, runs),
        **_bytes(elf),
        **_stack(elf, firmware, runs),
    }


def _spent(elf: Path, runs: dict[Case, Run], tell: Tell) -> dict[str, Any]:
    """Instructions as QEMU counts them, cycles and floating-point operations by the trace."""
    spent: dict[str, Any] = {"instructions": {}, "cycles": {}, "floating_point_operations": {}}
    for done, ((estimator, model, form), run) in enumerate(runs.items()):
        tell(done, len(runs), f"{estimator} {model} {form} in Unicorn")
        time = sample_times(record(model))
        traced = trace.trace(elf, record(model), model, estimator, form, 0, len(time) - 1)
        for what, counted in (("instructions", run.instructions), ("cycles", traced.cycles)):
            place = spent[what] if form == "update" else spent[what].setdefault(form, {})
            place.setdefault(estimator, {})[model] = vars(Count.of(counted, run, time))
        if form == "update":
            place = spent["floating_point_operations"].setdefault(estimator, {})
            place[model] = _operations(traced, is_steady(run, time))
    gaps = {each: after_gap(elf, "lever", each) for each in ESTIMATORS}
    spent["instructions_after_gap"] = {each: instructions for each, (instructions, _) in gaps.items()}
    spent["cycles_after_gap"] = {each: cycles for each, (_, cycles) in gaps.items()}
    return spent


def after_gap(elf: Path, model: str, estimator: str) -> tuple[int, int]:
    """Instructions and cycles of the dearest call there is: the first sample after a gap. Raise LeverError."""
    cut, first = record(model).without(GAP_S), round(GAP_S[0] * 1e3)
    run = image.run(elf, cut, model, estimator, "update")
    traced = trace.trace(elf, cut, model, estimator, "update", first, first)
    return int(run.instructions[first]), int(traced.cycles[0])


def _init(elf: Path, runs: dict[Case, Run]) -> dict[str, int]:
    """Return the init of lever_init(), which is called once."""
    traced = trace.trace(elf, record("lever"), "lever", "dual", "update", trace.INIT, trace.INIT)
    return {"instructions": runs["dual", "lever", "update"].init, "cycles": int(traced.cycles[0])}


def _operations(traced: trace.Trace, steady: NDArray[np.bool_]) -> dict[str, float]:
    """Return the floor under the instructions of lever_update(), and how far that is away."""
    operations, mean = traced.operations[steady], float(traced.operations[steady].mean())
    return {
        "mean": round(mean, 1),
        "worst": int(operations.max()),
        "instructions_per_operation": round(float(traced.instructions[steady].mean()) / mean, 3),
    }


def _calibration(runs: dict[Case, Run]) -> dict[str, float]:
    """Return the calibration of all runs the one that is off most; image.run() has refused what is not right."""
    worst = max(runs.values(), key=lambda run: abs(run.loop_measured - run.loop_instructions))
    return {
        "loop_instructions": worst.loop_instructions,
        "loop_measured": round(worst.loop_measured, 2),
        "overhead_subtracted": worst.overhead,
    }


def _bytes(elf: Path) -> dict[str, Any]:
    library, instance = sizes.of_core(elf), sizes.of_instance(elf)
    return {
        "text_bytes": library["text"],
        "rodata_bytes": library["rodata"],
        "data_bytes": library["data"],
        "bss_bytes": library["bss"],
        "recorder_bytes": library["recorder"],
        "instance_bytes": instance["lever"],
        "memory_bytes": instance["lever_memory"],
        "files": sizes.of_files(elf),
    }


def _stack(elf: Path, firmware: Path, runs: dict[Case, Run]) -> dict[str, Any]:
    """Return the worst case by the call graph, and what was seen to be written in all runs."""
    chains = stack.worst_case(elf, facade(firmware))
    painted = {"lever_update": 0, "tick": 0, **dict.fromkeys(image.CALLED_ONCE, 0)}
    for (_, _, form), run in runs.items():
        name = "tick" if form == "tick" else "lever_update"
        for function, found in ((name, int(run.stack.max())), *run.calls_stack.items()):
            painted[function] = max(painted[function], found)
    return {
        "stack_bytes": max(chain.bytes for name, chain in chains.items() if name not in ON_A_DESKTOP),
        "stack_painted_bytes": max(painted.values()),
        "stack": {
            name: {"bytes": chain.bytes, "chain": [f"{function} {frame}" for function, frame in chain.chain]}
            for name, chain in chains.items()
        },
        "stack_painted": painted,
    }
