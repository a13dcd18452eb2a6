"""What can be known of the pilot with and without a known torque: estimates of the lever's model, and a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ..linearised import covariances, variances
from ..matched import Condition, matched
from .description import Column, Curve, Figure, Row, Trace, interval, number, percent
from .runs import DITHER, PRIOR, WILD, Extent, estimates, matched_config, shown

_LABELS = ("m_p [kg]", "c_p [N s/m]", "k_p [N/m]", "f_n [Hz]", "ζ [1]")
_CASES = {"base only": 0.0, f"base and {DITHER:g} N m dither": DITHER}
_ESTIMATORS = {"dual": "estimate", "joint": "joint"}  # and their looks


@dataclass(frozen=True)
class _Case:
    """One run; columns of everything are m_p, c_p, k_p, natural frequency, damping ratio."""

    time: Array
    """(T,) [s]"""
    truth: Array
    """(T, 5)"""
    linearised: Array
    """(T, 5) standard deviation relative to the truth of a Kalman filter linearised at the truth."""
    estimates: dict[str, tuple[Array, Array]]
    """By estimator: values and standard deviations, each (T, 5)."""


def identification(seed: int, extent: Extent) -> Figure:
    """Draw parameters and dynamics of one pilot, dual and joint filter, without and with dither, and a reference."""
    cases = {title: _case(seed, extent, dither) for title, dither in _CASES.items()}
    columns = tuple(
        Column(title, tuple(Row(label, _traces(case, index)) for index, label in enumerate(_LABELS)))
        for title, case in cases.items()
    )
    title, end = "Nonlinear parameter identification", extent.duration
    settled, caption = WILD * end, _caption(cases, WILD * end)
    return Figure("identification", title, caption, columns, (0.0, end), scaled_from=settled, row_height=0.95)


def _case(seed: int, extent: Extent, dither: float) -> _Case:
    condition = Condition("lever", "fixed", dither_rms=dither, settings=PRIOR)
    batch = matched(condition, 1, extent.duration, seed)
    at = shown(batch)
    assert batch.truth.p is not None
    by_estimator: dict[str, tuple[Array, Array]] = {}
    for name in _ESTIMATORS:
        by_estimator[name] = _quantities(estimates(matched_config(condition, name), batch, at=at))
    truth = np.concatenate((batch.truth.p[0, at], batch.truth.dynamics[0, at]), axis=-1)
    linearised = np.sqrt(variances(batch, at, covariances(batch, at))[0])
    return _Case(at * batch.period, truth, linearised, by_estimator)


def _quantities(columns: dict[str, NDArray[np.float64]]) -> tuple[Array, Array]:
    def joined(ending: str) -> Array:
        dynamics = (columns[f"natural_frequency{ending}"], columns[f"damping_ratio{ending}"])
        return np.column_stack((columns[f"parameter{ending}"], *dynamics))

    return joined(""), joined("_sigma")


def _traces(case: _Case, index: int) -> tuple[Trace, ...]:
    truth = case.truth[:, index]
    around = interval(case.time, truth, truth * case.linearised[:, index], "linearised at the truth: ± 2σ", "reference")
    traces: list[Trace] = [around]
    for name, look in _ESTIMATORS.items():
        value, sigma = (part[:, index] for part in case.estimates[name])
        traces.append(Curve(case.time, value, name, look))
        traces.append(interval(case.time, value, sigma, f"{name} ± 2σ", f"{look}-edge", filled=False))
    traces.append(Curve(case.time, truth, "truth", "truth"))
    return tuple(traces)


def _caption(cases: dict[str, _Case], settled: float) -> str:
    without, with_dither = cases.values()
    sigmas = [
        f"{label.split()[0]} {number(100.0 * _claimed(without)[index])} → {percent(_claimed(with_dither)[index])} "
        f"({number(100.0 * without.linearised[-1, index])} → {percent(with_dither.linearised[-1, index])})"
        for index, label in enumerate(_LABELS)
    ]
    apart = max(_apart(case) for case in cases.values())
    return (
        "Parameters, natural frequency f_n and damping ratio ζ of one pilot from the firmware's dual and joint filters "
        "(thin lines: the ±2σ that they state). The shaded band is ±2σ, about the truth, of a Kalman filter linearised "
        "there. First the base alone shakes the lever, then the motor adds a known torque of "
        f"{number(DITHER)} N m rms: same pilot, same axes. σ of the dual filter at the end, without → with that "
        f"torque, and in brackets that of the filter linearised at the truth: {', '.join(sigmas)}. Dual and joint are "
        f"nowhere more than {number(apart)} σ apart. The axes are scaled to what follows the first {number(settled)} s."
    )


def _claimed(case: _Case) -> Array:
    """Return (5,) relative σ of the dual filter at the end."""
    value, sigma = case.estimates["dual"]
    last: Array = sigma[-1] / value[-1]
    return last


def _apart(case: _Case) -> float:
    (dual, sigma), (joint, _) = case.estimates["dual"], case.estimates["joint"]
    return float(np.max(np.abs(dual - joint) / sigma))
