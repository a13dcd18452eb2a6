"""One row of figures for each estimator in each case."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...oracle.cdkf import Array
from ..data import OUTPUTS, PARAMETERS
from ..matched import KINDS
from ..scores import Consistency, consistency, honesty, median_and_worst, ratio, ratio_spread, rms, settling_times
from .campaign import Outcome, Results
from .cases import BoolArray, Case, cases
from .entrants import Entrant, entrants

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
    score: float = math.nan
    """Geometric mean over the quantities of rms errors as they are held against the bound: who is best."""
    against: Five = UNKNOWN
    """rms error ÷ that of the entrant's reference."""
    bound: Five = UNKNOWN
    """rms error ÷ bound."""
    bound_error: Five = UNKNOWN
    """Its standard error."""
    honesty: Five = UNKNOWN
    """Stated standard deviation ÷ rms error."""
    nees: float = math.nan
    nees_low: float = math.nan
    nees_high: float = math.nan
    """Where its mean would lie in 95 % of batches."""
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
    """Names of what is estimated."""
    return (*KINDS[case.model].parameters, "natural_frequency", "damping_ratio")


def judge(results: Results) -> list[Row]:
    """All rows, case by case in the order of the registry."""
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
    return rows


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
    if case.name in results.least:
        row = _with_bound(row, outcome.errors[intact][:, judged], results.least[case.name], intact, judged)
    change = case.change(results.plan)
    if change is None:
        return row
    median, worst = settled(outcome, change)
    return replace(row, settled_median=median, settled_worst=worst)


def _intact(outcome: Outcome) -> BoolArray:
    """(B,) whether a run never broke down."""
    dynamics = outcome.errors[..., PARAMETERS:]
    known = ~np.isnan(outcome.errors[..., :PARAMETERS]).all()
    values = outcome.errors if known else dynamics
    return np.asarray(np.isfinite(values).all(axis=(1, 2)), dtype=np.bool_)


def _with_errors(row: Row, outcome: Outcome, intact: BoolArray, judged: BoolArray) -> Row:
    errors = outcome.errors[intact][:, judged]
    size = rms(errors)
    known = size[np.isfinite(size)]
    row = replace(row, rms=_five(rms(outcome.relative[intact][:, judged])), score=math.exp(float(np.log(known).mean())))
    if outcome.stated is None:
        return row
    return replace(row, honesty=_five(honesty(errors, outcome.stated[intact][:, judged])))


def _with_bound(row: Row, errors: Array, least: Array, intact: BoolArray, judged: BoolArray) -> Row:
    part = least[: len(intact)][intact][:, judged]
    row = replace(row, bound=_five(ratio(errors, part)))
    return replace(row, bound_error=_five(ratio_spread(errors, part, seed=0))) if len(errors) > 1 else row


def _with_consistency(row: Row, outcome: Outcome, intact: BoolArray, judged: BoolArray) -> Row:
    """NEES and NIS, where they are known of at least two runs."""
    nees = _consistent(outcome.nees, PARAMETERS, intact, judged)
    if nees is not None:
        low, high = nees.mean_band
        row = replace(row, nees=nees.mean, nees_low=low, nees_high=high, nees_inside=nees.inside)
    nis = _consistent(outcome.nis, OUTPUTS, intact, judged)
    return row if nis is None else replace(row, nis=nis.mean, nis_inside=nis.inside)


def _consistent(squares: Array | None, freedom: int, intact: BoolArray, judged: BoolArray) -> Consistency | None:
    part = None if squares is None else squares[intact][:, judged]
    if part is None or len(part) < 2 or not np.isfinite(part).all():
        return None
    return consistency(part, freedom)


def settled(outcome: Outcome, change: float) -> tuple[float, float]:
    """Median and worst time [s] after `change` [s] until the frequency is within 5 % for good; inf: never."""
    median, worst = median_and_worst(settling_times(outcome.errors[..., FREQUENCY], outcome.time - change))
    return (math.inf if math.isnan(median) else median), (math.inf if math.isnan(worst) else worst)


def _five(values: Array) -> Five:
    first, second, third, frequency, damping = (float(value) for value in values)
    return first, second, third, frequency, damping
