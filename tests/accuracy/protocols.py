"""The protocols of others as tables for PAPER.md: rising remnant (Olivari), square wave of stiffness (van de Ruit).

M. Olivari and others 2014 and 2016; M. van de Ruit and others 2018. Arms, noises and signals are ours, so that only the
questions are the same.
"""

from __future__ import annotations

import numpy as np
from lever_cdkf.cli.tables import Row
from lever_cdkf.numeric.arrays import Array
from lever_sil.study.compare.cases import SQUARE, Protocol, cases
from lever_sil.study.compare.evaluation import FREQUENCY
from lever_sil.study.compare.paper import of_runs, pair
from lever_sil.study.compare.run_cases import Outcome, Results
from lever_sil.study.data import PARAMETERS, Batch

SEEDS = 100
SQUARE_WAVE = "square_wave"
REACHED = 0.63
"""Part of a rise of the stiffness that counts as risen: a time constant, if it were of first order."""
_STIFFNESS = PARAMETERS - 1


def names() -> list[str]:
    """Return the cases with a remnant."""
    return [name for name in cases() if name.startswith("remnant_")]


def remnants(results: Results) -> list[Row]:
    """Return a row for each case with a remnant and each estimator: of the natural frequency."""
    rows: list[Row] = []
    for (name, estimator), outcome in results.outcomes.items():
        case = cases()[name]
        assert isinstance(case, Protocol)
        errors = 100.0 * outcome.relative[:, case.judged(outcome.time, results.plan), FREQUENCY]
        times = of_runs(outcome, case, results.plan).followed
        rows.append(
            {
                "parameters": case.truth,
                "remnant [rad/s/√s]": f"{case.process_noise:g}",
                "estimator": estimator,
                "f_n: rms [%]": pair(np.sqrt(np.square(errors).mean(axis=1))),
                "f_n: sd over runs [%]": f"{np.sqrt(errors.var(axis=0, ddof=1).mean()):.2g}",
                "f_n to 5 % [s]": pair(np.where(np.isnan(times), np.inf, times)),
            }
        )
    return rows


def square_wave(results: Results) -> list[Row]:
    """Return a row for each estimator on the square wave, and one for the true parameters: of the stiffness."""
    case, plan = cases()[SQUARE_WAVE], results.plan
    assert isinstance(case, Protocol)
    batch = case.batch(plan)
    rows: list[Row] = []
    for (name, estimator), outcome in results.outcomes.items():
        assert name == SQUARE_WAVE
        judged = case.judged(outcome.time, plan)
        errors = 100.0 * outcome.relative[:, judged, _STIFFNESS]
        bias, scatter = errors.mean(axis=0), errors.std(axis=0)
        rows.append(
            {
                "estimator": estimator,
                "VAF [%]": pair(-accounted(batch, outcome, judged)),
                "bias [%]": _size(bias),
                "random error [%]": _size(scatter),
                "total error [%]": _size(errors),
                "rise [s]": _risen(case, results, outcome),
            }
        )
    some = next(iter(results.outcomes.values()))
    judged = case.judged(some.time, plan)
    exact = Outcome(some.time, np.zeros_like(some.errors), some.relative, None, None, None, 0.0, 1)
    return [*rows, {"estimator": "the true parameters", "VAF [%]": pair(-accounted(batch, exact, judged))}]


def accounted(batch: Batch, outcome: Outcome, judged: Array) -> Array:
    """Return (B,) variance of the true theta that a simulation with the estimated parameters accounts for [%]."""
    assert batch.truth.p is not None
    at = np.round(outcome.time / batch.period).astype(np.int64)
    w = batch.knowledge.scaled(batch.truth.p[:, at]) + outcome.errors[..., :PARAMETERS]
    held = np.clip(np.searchsorted(at, np.arange(batch.samples), side="right") - 1, 0, len(at) - 1)
    x = np.zeros((batch.runs, batch.samples, 2))
    for k in range(batch.samples - 1):
        x[:, k + 1] = batch.move(k, x[:, k], w[:, held[k]])
    true = batch.truth.x[:, at[judged], 0] - batch.trim[:, at[judged]]
    share: Array = 100.0 * (1.0 - np.var(true - x[:, at[judged], 0], axis=1) / np.var(true, axis=1))
    return share


def _size(errors: Array) -> str:
    return f"{np.sqrt(np.square(errors).mean()):.2g}"


def _risen(case: Protocol, results: Results, outcome: Outcome) -> str:
    """Return time from a rise until the mean over runs and rises of the estimate has done REACHED of it [s]."""
    high = case.high(outcome.time, results.plan)
    factor = np.where(high, SQUARE, 1.0)
    estimate = ((1.0 + outcome.relative[..., _STIFFNESS]) * factor).mean(axis=0)
    starts = np.flatnonzero(high & ~np.roll(high, 1))
    length = int(high.sum()) // len(starts)
    before, after = estimate[starts - 1].mean(), np.mean([estimate[start : start + length] for start in starts], axis=0)
    there = np.flatnonzero(after - before >= REACHED * (SQUARE - 1.0))
    return f"{there[0] * case.every:.2g}" if len(there) else "never"
