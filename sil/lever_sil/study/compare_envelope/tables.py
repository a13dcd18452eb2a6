"""The joint filters' results as tables, and whether the firmware's errors are larger or smaller than a peer's."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
from lever_cdkf.cli.tables import Row

from ..compare.comparison import LEAST_RUNS, Differences, corrected, of_errors
from .filters import JOINT_FILTERS
from .run_estimators import ESTIMATORS, FIRMWARE, EstimatorResult


def tables(results: Sequence[EstimatorResult], seeds: int) -> dict[str, list[Row]]:
    """Return median and worst run of each estimator in each condition: errors, and coverage."""
    of = f"median / worst of {seeds} pilots or more"
    return {
        f"rms error of f_n (θ/z̈ of other pilots) [%], {of}": _table(results, "rms"),
        f"share of time within ±2σ [%], {of}": _table(results, "covered"),
    }


def _table(results: Sequence[EstimatorResult], what: str) -> list[Row]:
    lines: list[Row] = []
    for condition, group in groupby(results, key=lambda result: result.condition):
        cells = {name: "" for name in ESTIMATORS if any(result.estimator == name for result in results)}
        cells |= {result.estimator: " / ".join(map(_text, _two(result, what))) for result in group}
        lines.append({"condition": condition, **cells})
    return lines


def _two(result: EstimatorResult, what: str) -> tuple[float, float]:
    """Return median and worst."""
    values = result.rms if what == "rms" else result.covered
    return float(np.median(values)), float(values.max() if what == "rms" else values.min())


def _text(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "∞"


def rows(results: Sequence[EstimatorResult]) -> list[Row]:
    """Return a row for each estimator in each condition, with numbers."""
    table: list[Row] = []
    for result in results:
        (rms, worst), (covered, least) = _two(result, "rms"), _two(result, "covered")
        table.append(
            {
                "condition": result.condition,
                "estimator": result.estimator,
                "runs": len(result.rms),
                "rms median [%]": rms,
                "rms worst [%]": worst,
                "covered median [%]": covered,
                "covered worst [%]": least,
            }
        )
    return table


def differences(results: Sequence[EstimatorResult]) -> Differences:
    """Return the differences of the joint filters' errors against the firmware's in each condition.

    Those that broke down in a run are left out.
    """
    compared: Differences = {}
    for condition, group in groupby(results, key=lambda result: result.condition):
        squares = {one.estimator: np.square(one.rms)[:, np.newaxis] for one in group if np.isfinite(one.rms).all()}
        if FIRMWARE in squares and len(squares) > 1:
            compared |= of_errors(condition, squares, FIRMWARE)
    return corrected(compared)[0]


def verdicts(results: Sequence[EstimatorResult]) -> Iterator[str]:
    """Yield a sentence on the firmware against each joint filter."""
    if any(len(result.rms) < LEAST_RUNS for result in results):
        yield f"Too few runs for a verdict: at least {LEAST_RUNS} are needed."
        return
    compared = differences(results)
    for joint_filter in JOINT_FILTERS:
        pairs = {condition: one for (condition, name), one in compared.items() if name == joint_filter}
        if not pairs:
            continue
        larger = [condition for condition, one in pairs.items() if one.significant and one.more < 0.0]
        smaller = [condition for condition, one in pairs.items() if one.significant and one.more > 0.0]
        names = f" ({', '.join(larger)})" if larger else ""
        alike = len(pairs) - len(larger) - len(smaller)
        yield (
            f"The firmware's errors against {joint_filter}: smaller in {len(smaller)} conditions, larger in "
            f"{len(larger)}{names}, no significant difference in {alike}."
        )
