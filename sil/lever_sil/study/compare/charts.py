"""The figures of the page, from rows and outcomes; each is None where there is nothing to show."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import cycle, groupby
from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.report.figure import SERIES, Figure, Spec, axis, band, dots, line

from ...measures import settling_times
from ..baselines import BASELINES
from .cases import cases
from .entrants import OURS, entrants
from .evaluation import FREQUENCY, Row, quantities
from .run_cases import Results

COLOURS = dict(zip((*OURS, *BASELINES), cycle(SERIES)))
"""Of an estimator, on all charts; that of the firmware has the same in all its settings."""
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "star")
"""Of the series of a chart."""
_LANE = 22  # [pixels] of one estimator in a figure, for one series; further ones take a third of it
_SHOWN_AFTER = 15.0  # [s] after a step


def linearised(rows: Sequence[Row], model: str, preload: str) -> Figure | None:
    """Error of each estimator in the matched cases of a model ÷ that of the filter linearised at the truth."""
    chosen = [row for row in _walks(rows, model, preload) if math.isfinite(_average(row.linearised))]
    return _lanes(
        chosen,
        "error ÷ Kalman filter linearised at the truth",
        lambda row: _average(row.linearised),
        lambda row: _average(row.linearised_error),
        1.0,
    )


def bound(rows: Sequence[Row], model: str, preload: str) -> Figure | None:
    """Return the same ÷ posterior Cramér–Rao bound."""
    chosen = [row for row in _walks(rows, model, preload) if math.isfinite(_average(row.bound))]
    return _lanes(chosen, "error ÷ posterior Cramér–Rao bound", lambda row: _average(row.bound), lambda _: 0.0, 1.0)


def nees(rows: Sequence[Row], model: str) -> Figure | None:
    """Return mean NEES of each estimator in the matched cases of a model, preload fixed, with its 95 % band."""
    chosen = [row for row in _walks(rows, model, "fixed") if math.isfinite(row.nees)]
    figure = _lanes(chosen, "NEES (expected 3)", lambda row: row.nees, lambda _: 0.0, 3.0)
    if figure is not None:
        figure.shapes += [_vertical(edge, "fault") for edge in (chosen[0].nees_low, chosen[0].nees_high)]
    return figure


def _walks(rows: Sequence[Row], model: str, preload: str) -> list[Row]:
    """Return the walks of matched cases."""
    return [
        row
        for row in rows
        if (case := cases()[row.case]).kind == "matched" and case.model == model and case.preload == preload
    ]


def _average(values: Sequence[float]) -> float:
    """Geometric mean of those that are known."""
    positive = [value for value in values if math.isfinite(value) and value > 0.0]
    return math.exp(math.fsum(map(math.log, positive)) / len(positive)) if positive else math.nan


def _lanes(
    rows: Sequence[Row], title: str, value: Callable[[Row], float], error: Callable[[Row], float], mark: float
) -> Figure | None:
    """Return a lane for each estimator, a symbol for each case, over a logarithmic axis with a line at `mark`."""
    if not rows:
        return None
    names = list(dict.fromkeys(row.estimator for row in rows))
    series = [(case, list(group)) for case, group in groupby(rows, key=lambda row: row.case)]
    figure = _figure(names, title, len(series), type="log")
    for index, (case, members) in enumerate(series):
        at = np.array([names.index(row.estimator) + _offset(index, len(series)) for row in members], dtype=float)
        values, errors = (np.array([of(row) for row in members]) for of in (value, error))
        figure.add(*_marks(values, at, [row.estimator for row in members], case, index, errors))
    figure.shapes.append(_vertical(mark))
    return figure


def _colour(estimator: str) -> str:
    """dual_shipped is a dual; what is not in the registry has the last colour."""
    ours = next((COLOURS[name] for name in OURS if estimator.startswith(f"{name}_")), SERIES[-1])
    return COLOURS.get(estimator, ours)


def _marks(
    values: Array, at: Array, estimators: Sequence[str], name: str, index: int, errors: Array | None = None
) -> list[Spec]:
    """Return one for each estimator; and for the legend one without a place, as they have no common colour."""
    look: Spec = {"size": 8, "symbol": SYMBOLS[index % len(SYMBOLS)]}
    colours = [f"@{_colour(estimator)}" for estimator in estimators]
    more: Spec = {"marker": look | {"color": colours}, "hovertemplate": f"%{{x:.3g}}<extra>{name}</extra>"}
    if errors is not None:
        widths = [float(width) if math.isfinite(width) else 0.0 for width in errors]
        more["error_x"] = {"type": "data", "array": widths, "thickness": 1.2, "width": 0, "color": "@mark"}
    nowhere, plain = np.array([math.nan]), look | {"color": "@text"}
    return [
        dots(values, at, name, "text", showlegend=False, **more),
        dots(nowhere, nowhere, name, "text", marker=plain),
    ]


def _offset(index: int, count: int) -> float:
    return 0.6 * ((index + 0.5) / count - 0.5)


def _figure(names: Sequence[str], title: str, series: int, **x_axis: Any) -> Figure:
    """Return an empty figure with a lane for each name, the first on top."""
    lanes: Spec = {
        "tickvals": list(range(len(names))),
        "ticktext": list(names),
        "automargin": True,
        "range": [len(names) - 0.5, -0.5],
        "zeroline": False,
    }
    height = round(_LANE * len(names) * (1.0 + 0.3 * (series - 1))) + 70 + 20 * series
    more: Spec = {"margin": {"l": 20, "r": 12, "t": 30 + 20 * series, "b": 44}, "hovermode": "closest"}
    more["showlegend"] = series > 1
    return Figure([lanes], axis(title, **x_axis), height, more=more, over_time=False)


def _vertical(at: float, colour: str = "mark") -> Spec:
    style = {"color": f"@{colour}", "width": 1.5, "dash": "dot"}
    return {"type": "line", "x0": at, "x1": at, "y0": 0, "y1": 1, "yref": "paper", "line": style}


def settling(results: Results, case: str) -> Figure | None:
    """Return the settling of each run, when the natural frequency was found for good.

    It is hollow at the right end: never.
    """
    change, names = cases()[case].change(results.plan), _present(results, case)
    if change is None or not names:
        return None
    figure = _figure(names, "time after the step [s]", 1)
    for index, name in enumerate(names):
        outcome = results.outcomes[case, name]
        elapsed = outcome.time - change
        times = settling_times(outcome.errors[..., FREQUENCY], elapsed)
        lane = index + np.linspace(-0.25, 0.25, len(times))
        never = np.isnan(times)
        for chosen, symbol in ((~never, "circle"), (never, "circle-open")):
            marker = {"color": f"@{_colour(name)}", "size": 6, "symbol": symbol}
            shown = np.where(never, elapsed[-1], times)[chosen]
            figure.add(dots(shown, lane[chosen], name, "text", marker=marker, showlegend=False))
    return figure


def following(results: Results, case: str) -> Figure | None:
    """Return the error of the natural frequency about the step.

    It is the median over runs, and of the first of ours the middle half.
    """
    change, names = cases()[case].change(results.plan), _present(results, case)
    if change is None or not names:
        return None
    ours, others = ([name for name in names if _is_ours(case, name) is own] for own in (True, False))
    shown = ours[:1] + others
    figure = Figure([axis("error of f_n [%]", range=[-25, 35])], axis("time after the step [s]"), 380, over_time=False)
    for name in shown:
        outcome = results.outcomes[case, name]
        elapsed = outcome.time - change
        near = (elapsed > -2.0) & (elapsed < _SHOWN_AFTER)
        errors = 100.0 * outcome.errors[:, near, FREQUENCY]
        low, middle, high = np.quantile(np.where(np.isfinite(errors), errors, 1e6), (0.25, 0.5, 0.75), axis=0)
        if _is_ours(case, name):
            figure.add(*band(elapsed[near], low, high, f"{name}, middle half of runs", "estimate-band"))
        figure.add(line(elapsed[near], middle, name, _colour(name)))
    figure.level(-5.0, 5.0)
    return figure


def _present(results: Results, case: str) -> list[str]:
    return [name for name in entrants(cases()[case]) if (case, name) in results.outcomes]


def _is_ours(case: str, name: str) -> bool:
    return entrants(cases()[case])[name].ours


def wrong_noise(rows: Sequence[Row], case: str) -> Figure | None:
    """Return the rms error ÷ that of the tuned filter for each wrong noise, a symbol for each quantity."""
    chosen = [row for row in rows if row.case == case and math.isfinite(row.against[FREQUENCY])]
    if not chosen:
        return None
    names, parts = [row.estimator for row in chosen], quantities(cases()[case])
    figure = _figure(names, "rms error ÷ that of the filter told the truth", len(parts))
    for index, part in enumerate(parts):
        at = np.arange(len(names), dtype=float) + _offset(index, len(parts))
        figure.add(*_marks(np.array([row.against[index] for row in chosen]), at, names, part, index))
    figure.shapes += [_vertical(1.0), _vertical(1.5, "fault")]
    return figure
