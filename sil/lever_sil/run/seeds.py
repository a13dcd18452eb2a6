"""A scenario with many seeds: median and worst of what the summaries of its runs say.

A run is one draw of noise, vibration and turbulence. Its errors last for seconds, so that its figures, coverage above
all, are partly luck; those of many seeds are not. The runs go over CAN frames as a single one does, in processes, and
leave no files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from lever_cdkf.cli.tables import Row, Tables
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.results.summary import SimulationSummary
from lever_cdkf.results.whiteness import CANNOT_SEE
from lever_cdkf.runtime import interrupts

from .summary import kept_limits, missed_limits

_Task = TypeVar("_Task")
_Done = TypeVar("_Done")

Progress = Callable[[int, int, str], None]
"""Called after each run: how many are done, of how many, and what the last one was."""


@dataclass(frozen=True)
class Task:
    """One run."""

    scenario: str
    """Name or file, as scenario.load()."""
    seed: int
    overrides: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.scenario}, seed {self.seed}"


def run(tasks: Sequence[Task], jobs: int, progress: Progress | None = None) -> list[SimulationSummary]:
    """Return the summaries of all runs in the order of `tasks`, from `jobs` processes. Raise LeverError."""
    return in_processes(simulate, tasks, jobs, progress)


def in_processes(
    function: Callable[[_Task], _Done], tasks: Sequence[_Task], jobs: int, progress: Progress | None = None
) -> list[_Done]:
    """function(task) of all tasks, in their order, from `jobs` processes. Interrupted, it leaves no process behind."""
    results = []
    for done, (task, result) in enumerate(zip(tasks, interrupts.in_processes(function, tasks, jobs), strict=True), 1):
        results.append(result)
        if progress is not None:
            progress(done, len(tasks), str(task))
    return results


def simulate(task: Task) -> SimulationSummary:
    """Return the summary of one run. Raise LeverError."""
    from ..scenarios import scenario
    from . import runner

    return runner.simulate(scenario.load(task.scenario, (*task.overrides, f"seed={task.seed}"))).summary


# --- figures of one scenario -----------------------------------------------------------------------------------------


def rms(summaries: Sequence[SimulationSummary], key: str) -> FloatArray:
    """Rms error of each run [%]; infinite where a run has none to judge."""
    values = [summary.parameters[key].rms_percent for summary in summaries]
    return np.array([math.inf if value is None else value for value in values])


def coverage(summaries: Sequence[SimulationSummary], key: str) -> FloatArray:
    """Return the share of the time of each run at which +-2 sigma holds the truth [%].

    It is 0 where there is nothing to judge.
    """
    values = [summary.parameters[key].coverage_2sigma for summary in summaries]
    return 100.0 * np.array([value or 0.0 for value in values])


def times_to_5_percent(summaries: Sequence[SimulationSummary], key: str) -> FloatArray:
    """After the start and each jump, of all runs [s]; infinite where the error never stays within 5 %."""
    times = [time for summary in summaries for time in summary.parameters[key].time_to_5_percent_s]
    return np.array([math.inf if time is None else time for time in times])


def judged(summaries: Sequence[SimulationSummary]) -> list[str]:
    """Return the quantities of which at least one run has an error to judge: none in runs that are too short."""
    return [key for key in summaries[0].parameters if np.isfinite(rms(summaries, key)).any()]


def flagged(summaries: Sequence[SimulationSummary]) -> FloatArray:
    """Return share of the judged time of each run with a fault that warns [%]."""
    return 100.0 * np.array([summary.flagged_share or 0.0 for summary in summaries])


def missed(summaries: Sequence[SimulationSummary]) -> list[str]:
    """Return the limits that are not kept, in words.

    They are limits of the median of the rms errors, and of the coverage over all runs.
    """
    keys = judged(summaries)
    return missed_limits(
        summaries[0].scenario.limits,
        {key: float(np.median(rms(summaries, key))) for key in keys},
        {key: 0.01 * float(np.mean(coverage(summaries, key))) for key in keys},
    )


def troubles(summaries: Sequence[SimulationSummary]) -> list[str]:
    """Return what went wrong in runs, whatever their estimates, in words."""
    reasons = []
    for what, wrong in (
        ("samples without an answer", [summary.unanswered > 0 for summary in summaries]),
        ("estimates of other samples", [summary.misplaced > 0 for summary in summaries]),
        ("the estimator in fault", ["fault" in summary.modes_s for summary in summaries]),
    ):
        seeds = [str(each.scenario.seed) for each, bad in zip(summaries, wrong, strict=True) if bad]
        reasons += [f"{what} with seed {', '.join(seeds)}"] if seeds else []
    return reasons


def verdict(summaries: Sequence[SimulationSummary]) -> str:
    """Return the runs in a few sentences."""
    reasons = troubles(summaries) + missed(summaries)
    kept = kept_limits(*summaries) if summaries[0].scenario.limits else ""
    sentences = [f"Limits missed: {'; '.join(reasons)}." if reasons else kept]
    covered = {key: float(np.mean(coverage(summaries, key))) for key in judged(summaries)}
    if not covered:
        return "Too short to judge: the runs end before converged_after."
    least = min(covered, key=lambda key: covered[key])
    percent = math.floor(covered[least] + 1e-9)
    sentences.append(f"Over all runs ±2σ covers every truth for at least {percent} % of the time (least: {least}).")
    tested = [summary.whiteness.white for summary in summaries if summary.whiteness is not None]
    if tested:
        coloured = len(tested) - sum(tested)
        sentences.append(f"Residuals of {coloured} of {len(tested)} runs are coloured. {CANNOT_SEE}")
    return " ".join(sentence for sentence in sentences if sentence)


# --- tables ----------------------------------------------------------------------------------------------------------


def tables(summaries: Sequence[SimulationSummary]) -> Tables:
    """Return what is printed of the runs of one scenario."""
    scenario = summaries[0].scenario
    numbers = [summary.scenario.seed for summary in summaries]
    title = f"{scenario.title} ({len(numbers)} seeds, {numbers[0]} to {numbers[-1]})"
    return {
        title: [_quantity_row(summaries, key, numbers) for key in summaries[0].parameters],
        "share of the judged time with each fault": _fault_rows(summaries),
        "runs": [_runs_row(summaries)],
    }


def _quantity_row(summaries: Sequence[SimulationSummary], key: str, numbers: Sequence[int]) -> Row:
    errors, covered = rms(summaries, key), coverage(summaries, key)
    if not np.isfinite(errors).any():
        covered = np.full(len(covered), np.nan)
    times = times_to_5_percent(summaries, key)
    return {
        "quantity": key,
        "rms median [%]": _finite(np.median(errors)),
        "rms worst [%]": _finite(np.max(errors)),
        "worst seed": numbers[int(np.argmax(errors))],
        "coverage [%]": _finite(np.mean(covered)),
        "coverage median [%]": _finite(np.median(covered)),
        "coverage worst [%]": _finite(np.min(covered)),
        "to 5 % median [s]": _finite(np.median(times)),
        "to 5 % worst [s]": _finite(np.max(times)),
        "never to 5 % [%]": _finite(100.0 * np.mean(np.isinf(times))),
    }


def _fault_rows(summaries: Sequence[SimulationSummary]) -> list[Row]:
    names = list(dict.fromkeys(name for summary in summaries for name in summary.fault_shares))
    shares = {name: [100.0 * summary.fault_shares.get(name, 0.0) for summary in summaries] for name in names}
    shares["any that warns"] = flagged(summaries).tolist()
    return [
        {
            "fault": name,
            "share median [%]": _finite(np.median(values)),
            "share largest [%]": _finite(max(values)),
            "runs with it [1]": sum(value > 0.0 for value in values),
        }
        for name, values in shares.items()
    ]


def _runs_row(summaries: Sequence[SimulationSummary]) -> Row:
    correlations = [abs(each.whiteness.largest) for each in summaries if each.whiteness is not None]
    ratios = [each.nis.mean / each.nis.expected for each in summaries if each.nis.mean and each.nis.expected]
    return {
        "runs [1]": len(summaries),
        "samples a run [1]": summaries[0].samples,
        "NIS / expected median [1]": _finite(np.median(ratios)) if ratios else None,
        "NIS / expected largest [1]": _finite(max(ratios, default=math.nan)),
        "correlation median [1]": _finite(np.median(correlations)) if correlations else None,
        "correlation largest [1]": _finite(max(correlations, default=math.nan)),
        "simulated time [s]": sum(summary.simulated_time_s for summary in summaries),
        "firmware": summaries[0].firmware.version,
    }


def _finite(value: float | np.floating[Any]) -> float | None:
    """To two decimals, which is more than seeds can tell; None where there is no such error, share or time."""
    return round(float(value), 2) if math.isfinite(value) else None
