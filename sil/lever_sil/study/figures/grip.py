"""A pilot who tightens the grip at once: followed with and without the firmware's detection of changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.native import Config, lib
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ...measures import covered, settling_times
from ..data import Batch
from ..matched import Condition, jump, matched, tightened
from ..scores import median_and_worst
from .description import Band, Column, Curve, Figure, Row, number, percent, tracked
from .runs import DITHER, PRIOR, Extent, estimates, shown

_FACTORS = np.array((1.0, 1.3, 1.3))  # of m_p, c_p, k_p
_WITHIN = 0.1  # of the truth: when a change counts as followed
_WATCHED = 2.0  # [s] after the change
_MIDDLE = (10.0, 90.0)  # percentiles of the runs
_STIFFNESS = 2
_CASES = {"with detection": setting("change_threshold").default, "without": 0.0}


@dataclass(frozen=True)
class _Case:
    """All runs of one configuration at the times shown."""

    value: Array
    """(B, T, 4) m_p, c_p, k_p, natural frequency."""
    sigma: Array
    """(B, T, 4)"""
    noticed: NDArray[np.bool_]
    """(B, T) whether the firmware says CHANGE."""


def grip(seed: int, extent: Extent) -> Figure:
    """Draw a grip that tightens at once, followed with and without detection of changes."""
    condition = Condition("lever", "trim", dither_rms=DITHER, settings=PRIOR)
    calm = matched(condition, extent.runs, extent.duration, seed)
    moment = calm.samples // 2
    batch = tightened(calm, jump(calm.samples, moment, _FACTORS))
    at = shown(batch)
    time, change = at * batch.period, moment * batch.period
    cases = {title: _case(batch, condition, threshold, at) for title, threshold in _CASES.items()}
    assert batch.truth.p is not None
    truth = np.concatenate((batch.truth.p[:, at], batch.truth.dynamics[:, at, :1]), axis=-1)
    columns = tuple(Column(title, _rows(time, truth, case)) for title, case in cases.items())
    caption, shown_times = _caption(cases, truth, time - change), (0.5 * change, batch.samples * batch.period)
    return Figure("grip", "A sudden change of grip", caption, columns, shown_times, (change,))


def _case(batch: Batch, condition: Condition, threshold: float, at: NDArray[np.int64]) -> _Case:
    settings = {**condition.settings, "noise_window": 0.0, "change_threshold": threshold}
    config = Config("lever", "trim", "dual", "fixed", settings=settings)
    runs = [estimates(config, batch, run, at) for run in range(batch.runs)]

    def joined(ending: str) -> Array:
        columns = (np.column_stack((run[f"parameter{ending}"], run[f"natural_frequency{ending}"])) for run in runs)
        return np.stack(list(columns))

    faults = np.stack([run["faults"] for run in runs]).astype(np.int64)
    return _Case(joined(""), joined("_sigma"), (faults & lib.LEVER_FAULT_CHANGE) != 0)


def _rows(time: Array, truth: Array, case: _Case) -> tuple[Row, ...]:
    one = tuple(
        Row(label, tracked(time, truth[0, :, index], case.value[0, :, index], case.sigma[0, :, index]))
        for index, label in ((1, "c_p [N s/m]"), (_STIFFNESS, "k_p [N/m]"), (3, "f_n [Hz]"))
    )
    error = 100.0 * np.abs(case.value / truth - 1.0)[..., _STIFFNESS]
    low, high = np.percentile(error, _MIDDLE, axis=0)
    many = Row(
        "k_p error [%]",
        (
            Band(time, low, high, f"{_MIDDLE[1] - _MIDDLE[0]:g} % of {len(error)} runs", "many"),
            Curve(time, np.median(error, axis=0), "median of the runs", "median"),
        ),
    )
    return (*one, many)


def _caption(cases: dict[str, _Case], truth: Array, elapsed: Array) -> str:
    sentences = " ".join(_case_caption(title, case, truth, elapsed) for title, case in cases.items())
    watched = next(iter(cases.values())).noticed
    soon = int(watched[:, (elapsed >= 0.0) & (elapsed < _WATCHED)].any(axis=1).sum())
    before = np.diff(watched[:, elapsed < 0.0].astype(np.int64), axis=1, prepend=0)
    false = int((before > 0).sum())
    return (
        "At the dotted line the pilot tightens the grip: damping and stiffness jump by "
        f"{percent(_FACTORS[_STIFFNESS] - 1.0)}. Above, one run of the dual filter (preload trim, dither of "
        f"{number(DITHER)} N m rms) with the ±2σ that it states; below, the error of stiffness in all runs. With "
        "detection, the filter opens its uncertainty when its corrections drift to one side; without, it knows of no "
        f"changes but the random walk. {sentences} The change is noticed within {number(_WATCHED)} s in {soon} "
        f"of {len(truth)} runs; false alarms before it: {false} in {number(-elapsed[0] * len(truth), 3)} s."
    )


def _case_caption(title: str, case: _Case, truth: Array, elapsed: Array) -> str:
    relative = (case.value / truth - 1.0)[..., _STIFFNESS]
    median, worst = median_and_worst(settling_times(relative, elapsed, _WITHIN))
    after = (elapsed >= 0.0) & (elapsed < _WATCHED)
    inside = float(covered((case.value - truth)[:, after, _STIFFNESS], case.sigma[:, after, _STIFFNESS]))
    return (
        f"{title.capitalize()}, stiffness is within {percent(_WITHIN)} for good after {_seconds(median)} (median; "
        f"worst: {_seconds(worst)}), and in the first {number(_WATCHED)} s the band holds it in {percent(inside)} of "
        "the time."
    )


def _seconds(value: float) -> str:
    return f"{number(value)} s" if np.isfinite(value) else "never"
