"""Whether the stated covariances are right: normalised squares of the errors (NEES) against chi-square."""

from __future__ import annotations

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.numeric.quantiles import chi_square_band

from ...measures import normalised_squares
from ..data import PARAMETERS
from ..firmware import Firmware
from ..matched import Condition, matched
from ..scores import Consistency, consistency, errors
from .description import Band, Column, Curve, Figure, Row, Trace, number, percent
from .runs import DITHER, MATCHED, PRIOR, Extent, shown

_CASES = {"base only": 0.0, "with dither": DITHER}
_HEADROOM = 1.1  # of the y axes, above what is drawn
_ESTIMATORS = {"dual": "estimate", "joint": "joint"}  # and their looks


def nees(seed: int, extent: Extent) -> Figure:
    """Draw mean NEES of many runs over time, dual and joint, without and with dither, in its 95 % band."""
    drawn: dict[str, tuple[Trace, ...]] = {}
    sentences: list[str] = []
    for case, dither in _CASES.items():
        condition = Condition("lever", "fixed", dither_rms=dither, settings=PRIOR)
        batch = matched(condition, extent.runs, extent.duration, seed)
        at = shown(batch)
        traces: list[Trace] = list(_expected(at * batch.period, batch.runs))
        for name, look in _ESTIMATORS.items():
            estimator = Firmware("lever", "fixed", name, "fixed", {**condition.settings, **MATCHED})
            estimates = estimator(batch, at)
            assert estimates.covariance is not None
            squares = normalised_squares(errors(batch, estimates)[..., :PARAMETERS], estimates.covariance)
            traces.append(Curve(at * batch.period, squares.mean(axis=0), name, look))
            sentences.append(f"{case}, {name}: {_numbers(consistency(squares, PARAMETERS))}")
        drawn[f"NEES, {case} [1]"] = tuple(traces)
    caption = (
        "Squares of the errors of m_p, c_p and k_p in units of the covariance that the firmware states, mean of "
        f"{extent.runs} matched runs at each time. If the covariance is right the mean is {PARAMETERS}, and in the "
        "shaded band 95 % of the time; above it the filter is over-confident, below it too cautious. Mean over the "
        "run, the interval in which it would lie by chance, and the share of times in the band: "
        f"{'; '.join(sentences)}."
    )
    top = _HEADROOM * max(
        float(trace.y.max()) for traces in drawn.values() for trace in traces if isinstance(trace, Curve)
    )
    rows = tuple(Row(label, traces, (0.0, top)) for label, traces in drawn.items())
    columns, end = (Column("", rows),), batch.samples * batch.period
    return Figure("consistency", "Consistency of the covariance", caption, columns, (0.0, end), row_height=1.2)


def _expected(time: Array, runs: int) -> tuple[Trace, Trace]:
    low, high = (np.full_like(time, edge / runs) for edge in chi_square_band(PARAMETERS * runs))
    mean = np.full_like(time, PARAMETERS)
    return Band(time, low, high, "95 % by chance", "chance"), Curve(time, mean, "expected", "expected")


def _numbers(result: Consistency) -> str:
    low, high = result.mean_band
    return f"{number(result.mean, 3)} ({number(low, 3)} to {number(high, 3)}), {percent(result.inside)}"
