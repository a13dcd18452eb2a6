"""The tables of the experiment of the paper, by model: `lever compare --paper`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.cli.tables import Row
from lever_cdkf.numeric.arrays import Array

from ... import measures
from ..data import PARAMETERS
from .cases import Case, Paper, Plan, cases
from .evaluation import FREQUENCY
from .run_cases import Outcome, Results

SEEDS = 20


@dataclass(frozen=True)
class Figures:
    """Of each run, under every level of noise; (N,) arrays."""

    rms: Array
    """Error of the three parameters relative to the truth, root of the mean square."""
    bias: Array
    """The largest magnitude of their mean errors."""
    covered: Array
    """The least share of time at which one of them is within two stated standard deviations; NaN: none are stated."""
    followed: Array
    """Time [s] after a jump until the natural frequency stays within 5 %; NaN: never; empty without a jump."""


def names() -> list[str]:
    """Return the cases of the experiment."""
    return [name for name, case in cases().items() if case.kind == "paper"]


def tables(results: Results) -> dict[str, list[Row]]:
    """Return a table for each model, a row for each truth and estimator.

    A cell is median / worst of runs and levels of noise.
    """
    by_title: dict[str, list[Row]] = {}
    for (model, truth, estimator), figures in _gathered(results).items():
        by_title.setdefault(f"{model}, {results.plan.seeds} seeds", []).append(
            {
                "parameters": truth,
                "estimator": estimator,
                "rms [%]": pair(100.0 * figures.rms),
                "bias [%]": pair(100.0 * figures.bias),
                "±2σ covers [%]": pair(-100.0 * figures.covered),
                "f_n to 5 % [s]": pair(np.where(np.isnan(figures.followed), np.inf, figures.followed)),
            }
        )
    return by_title


def of_runs(outcome: Outcome, case: Case, plan: Plan) -> Figures:
    """Return the figures of each run of an estimator in a case."""
    judged = case.judged(outcome.time, plan)
    relative = outcome.relative[:, judged, :PARAMETERS]
    covered = np.full(len(relative), np.nan)
    if outcome.stated is not None:
        sigma = np.sqrt(outcome.stated[:, judged])
        covered = measures.covered(outcome.errors[:, judged], sigma, axis=1)[..., :PARAMETERS].min(axis=-1)
    change = case.change(plan)
    elapsed = np.empty(0) if change is None else outcome.time - change
    return Figures(
        measures.rms(relative, axis=(1, 2)),
        np.abs(relative.mean(axis=1)).max(axis=-1),
        covered,
        measures.settling_times(outcome.errors[..., FREQUENCY], elapsed) if len(elapsed) else elapsed,
    )


def _gathered(results: Results) -> Mapping[tuple[str, str, str], Figures]:
    parts: dict[tuple[str, str, str], list[Figures]] = {}
    for (name, estimator), outcome in results.outcomes.items():
        case = cases()[name]
        assert isinstance(case, Paper)
        parts.setdefault((case.model, case.truth, estimator), []).append(of_runs(outcome, case, results.plan))
    return {key: Figures(*map(np.concatenate, zip(*map(_columns, each), strict=True))) for key, each in parts.items()}


def _columns(figures: Figures) -> Iterator[Array]:
    yield from (figures.rms, figures.bias, figures.covered, figures.followed)


def pair(values: Array) -> str | None:
    """Return median and greatest of the values, of negative ones without their sign; infinity stands for never."""
    if not len(values) or np.isnan(values).all():
        return None
    return " / ".join(_text(abs(float(value))) for value in (np.median(values), np.max(values)))


def _text(value: float) -> str:
    if not math.isfinite(value):
        return "never"
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
