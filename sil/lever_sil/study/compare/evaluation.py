"""One row of figures for each estimator in each case."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from lever_cdkf.numeric.arrays import Array, BoolArray

from ... import measures
from ..data import OUTPUTS, PARAMETERS
from ..matched import KINDS
from ..scores import Consistency, consistency, median_and_worst, ratio, ratio_spread, sigma_ratio
from .cases import Case, References, cases
from .comparison import Differences, corrected, of_errors, of_times
from .entrants import Entrant, entrants
from .run_cases import Outcome, Results

Five = tuple[float, float, float, float, float]
"""Of the three parameters, natural frequency and damping ratio; NaN: not known."""

UNKNOWN: Five = (math.nan,) * 5
FREQUENCY = 3
"""Where the natural frequency stands in Five."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What there is to say of an estimator in a case. NaN where there is nothing."""

    case: str
    estimator: str
    ours: bool
    asked: int
    """Runs of the case."""
    runs: int
    """Of these, what the estimator was given."""
    failures: int
    """Of these, where it broke down (NaN); all figures are of the others."""
    rms: Five = UNKNOWN
    """Errors relative to the truth."""
    bias: Five = UNKNOWN
    """Mean errors relative to the truth: mean over runs of the magnitude of each run's mean."""
    covered: Five = UNKNOWN
    """Share of times at which the truth is within two stated standard deviations."""
    score: float = math.nan
    """Geometric mean over the quantities of rms errors as they are held against the references: who is best."""
    against: Five = UNKNOWN
    """rms error ÷ that of the entrant's reference."""
    linearised: Five = UNKNOWN
    """rms error ÷ that of the Kalman filter linearised at the truth."""
    linearised_error: Five = UNKNOWN
    """Its standard error."""
    bound: Five = UNKNOWN
    """rms error ÷ posterior Cramér–Rao bound."""
    baseline: Five = UNKNOWN
    """Of ours: rms error ÷ that of the best baseline, quantity by quantity."""
    baseline_error: Five = UNKNOWN
    """Its standard error."""
    sigma_ratio: Five = UNKNOWN
    """Stated standard deviation ÷ rms error."""
    nees: float = math.nan
    nees_low: float = math.nan
    nees_high: float = math.nan
    """Where its mean would lie in 95 % of batches or more."""
    nees_inside: float = math.nan
    """Share of times at which the mean over runs is in its 95 % band."""
    nis: float = math.nan
    nis_inside: float = math.nan
    settled_median: float = math.nan
    """After the jump, until the natural frequency is within 5 % for good [s]; inf: never."""
    settled_worst: float = math.nan
    microseconds: float = math.nan
    """Processor time for a step of a run."""
    relative_time: float = math.nan
    """The same ÷ that of the firmware's dual filter in this case."""

    @property
    def ranked(self) -> bool:
        """Whether it did all that the others did."""
        return self.runs == self.asked and self.failures == 0


def quantities(case: Case) -> tuple[str, ...]:
    """Return names of what is estimated."""
    return (*KINDS[case.model].parameters, "natural_frequency", "damping_ratio")


def judge(results: Results) -> list[Row]:
    """Return all rows, case by case in the order of the registry."""
    rows: list[Row] = []
    for case in cases().values():
        of_case = entrants(case)
        present = [name for name in of_case if (case.name, name) in results.outcomes]
        judged = {name: _row(case, of_case[name], results) for name in present}
        pace = next(
            (row.microseconds for row in judged.values() if row.ours and row.estimator.startswith("dual")), math.nan
        )
        for name, row in judged.items():
            reference = judged.get(of_case[name].reference)
            against = UNKNOWN if reference is None else _five(np.divide(row.rms, reference.rms))
            rows.append(replace(row, against=against, relative_time=row.microseconds / pace))
    return [_with_baseline(row, rows, results) for row in rows]


def _row(case: Case, entrant: Entrant, results: Results) -> Row:
    outcome = results.outcomes[case.name, entrant.name]
    intact = _intact(outcome)
    row = Row(
        case=case.name,
        estimator=entrant.name,
        ours=entrant.ours,
        asked=case.runs(results.plan),
        runs=len(intact),
        failures=int((~intact).sum()),
        microseconds=1e6 * outcome.seconds / outcome.steps,
    )
    judged = case.judged(outcome.time, results.plan)
    if not intact.any() or not judged.any():
        return row
    row = _with_errors(row, outcome, intact, judged)
    row = _with_consistency(row, outcome, intact, judged)
    if case.name in results.references:
        row = _with_references(row, outcome.errors[intact][:, judged], results.references[case.name], intact, judged)
    change = case.change(results.plan)
    if change is None:
        return row
    median, worst = settled(outcome, change)
    return replace(row, settled_median=median, settled_worst=worst)


def _intact(outcome: Outcome) -> BoolArray:
    """Return (B,) whether a run never broke down."""
    dynamics = outcome.errors[..., PARAMETERS:]
    has_parameters = ~np.isnan(outcome.errors[..., :PARAMETERS]).all()
    values = outcome.errors if has_parameters else dynamics
    return np.asarray(np.isfinite(values).all(axis=(1, 2)), dtype=np.bool_)


def _with_errors(row: Row, outcome: Outcome, intact: BoolArray, judged: BoolArray) -> Row:
    errors = outcome.errors[intact][:, judged]
    size = measures.rms(errors, axis=(0, 1))
    finite = size[np.isfinite(size)]
    relative = outcome.relative[intact][:, judged]
    row = replace(
        row,
        rms=_five(measures.rms(relative, axis=(0, 1))),
        bias=_five(np.abs(relative.mean(axis=1)).mean(axis=0)),
        score=math.exp(float(np.log(finite).mean())),
    )
    if outcome.stated is None:
        return row
    stated = outcome.stated[intact][:, judged]
    covered = measures.covered(errors, np.sqrt(stated), axis=(0, 1))
    return replace(row, sigma_ratio=_five(sigma_ratio(errors, stated)), covered=_five(covered))


def _with_references(row: Row, errors: Array, references: References, intact: BoolArray, judged: BoolArray) -> Row:
    linearised = references.linearised[intact][:, judged]
    return replace(
        row,
        linearised=_five(ratio(errors, linearised)),
        linearised_error=_five(ratio_spread(errors, linearised, seed=0)),
        bound=_five(ratio(errors, references.bound[judged])),
    )


def _with_baseline(row: Row, rows: list[Row], results: Results) -> Row:
    """Return one of ours beside the best baseline of each quantity."""
    others = [other for other in rows if other.case == row.case and not other.ours and other.ranked]
    if not (row.ours and row.ranked and others):
        return row
    best = [min(others, key=lambda other: other.rms[index]).estimator for index in range(len(UNKNOWN))]
    own, case = judged_errors(results, row.case, row.estimator), row.case
    theirs = np.stack([judged_errors(results, case, name)[..., i] for i, name in enumerate(best)], axis=-1)
    squares = np.square(theirs)
    return replace(row, baseline=_five(ratio(own, squares)), baseline_error=_five(ratio_spread(own, squares, seed=0)))


def judged_errors(results: Results, case: str, estimator: str) -> Array:
    """Return (B, T, 5) errors at the times that count."""
    outcome = results.outcomes[case, estimator]
    return outcome.errors[:, cases()[case].judged(outcome.time, results.plan)]


def compare(results: Results, rows: list[Row]) -> tuple[Differences, Differences]:
    """Of the errors, and of the times after a step, of those that did all runs of a case, against the best of them."""
    errors: Differences = {}
    times: Differences = {}
    for case in {row.case: None for row in rows}:
        names = [row.estimator for row in rows if row.case == case and row.ranked and math.isfinite(row.score)]
        if len(names) < 2:
            continue
        squares = {name: np.square(judged_errors(results, case, name)).mean(axis=1) for name in names}
        finite = np.isfinite(next(iter(squares.values()))).all(axis=0)
        errors |= of_errors(case, {name: square[:, finite] for name, square in squares.items()})
        change = cases()[case].change(results.plan)
        if change is not None:
            times |= of_times(case, _times(results, case, names, change))
    first, second = corrected(errors, times)
    return first, second


def _times(results: Results, case: str, names: list[str], change: float) -> Mapping[str, Array]:
    """Return (B,) settling times [s].

    Never counts as the time that was left, at once as the time between two estimates.
    """
    by_name = {}
    for name in names:
        outcome = results.outcomes[case, name]
        elapsed = outcome.time - change
        times = measures.settling_times(outcome.errors[..., FREQUENCY], elapsed)
        by_name[name] = np.maximum(np.where(np.isnan(times), elapsed[-1], times), cases()[case].every)
    return by_name


def _with_consistency(row: Row, outcome: Outcome, intact: BoolArray, judged: BoolArray) -> Row:
    """NEES and NIS, where they are known."""
    nees = _consistent(outcome.nees, PARAMETERS, intact, judged)
    if nees is not None:
        low, high = nees.mean_band
        row = replace(row, nees=nees.mean, nees_low=low, nees_high=high, nees_inside=nees.inside)
    nis = _consistent(outcome.nis, OUTPUTS, intact, judged)
    return row if nis is None else replace(row, nis=nis.mean, nis_inside=nis.inside)


def _consistent(squares: Array | None, freedom: int, intact: BoolArray, judged: BoolArray) -> Consistency | None:
    part = None if squares is None else squares[intact][:, judged]
    if part is None or not np.isfinite(part).all():
        return None
    return consistency(part, freedom)


def settled(outcome: Outcome, change: float) -> tuple[float, float]:
    """Return median and worst time [s] after `change` [s] until the frequency is within 5 % for good; inf: never."""
    median, worst = median_and_worst(measures.settling_times(outcome.errors[..., FREQUENCY], outcome.time - change))
    return (math.inf if math.isnan(median) else median), (math.inf if math.isnan(worst) else worst)


def _five(values: Array) -> Five:
    first, second, third, frequency, damping = (float(value) for value in values)
    return first, second, third, frequency, damping
