"""How near the loop through arm, lever and rotor is to collective bounce, where the estimator knows the aircraft."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...firmware.library import enum_names
from ...numeric.arrays import Array
from ...results.trace import CORRECTION, TRUE_MARGIN
from ..figure import Figure, Spec, axis, axis_range, band, edges, hover, line, time_axis
from ..run import Run
from ..series import spread_indices

_POINTS = 1500
_COLOURS = {"warning": "joint", "alarm": "fault"}


class Accuracy(NamedTuple):
    """How good the margin was after the first third of a run."""

    bias: float
    """Median of estimated minus true margin [dB]."""
    covered: float
    """Part of the time that ±2σ held the true margin."""


def accuracy(run: Run) -> Accuracy | None:
    """Return how good the margin was; None where there is no truth, or the margin was never known."""
    gain, sigma, true = (run.column(name) for name in ("gain_margin_dB", "gain_margin_sigma_dB", TRUE_MARGIN))
    if gain is None or sigma is None or true is None:
        return None
    later = slice(len(gain) // 3, None)
    error, sigma = (gain - true)[later], sigma[later]
    known = np.isfinite(error * sigma)
    if not known.any():
        return None
    return Accuracy(float(np.median(error[known])), float(np.mean(np.abs(error) <= 2.0 * sigma, where=known)))


def margin(run: Run, limits: tuple[float, ...] = ()) -> Figure | None:
    """Return gain margin, frequency and correction over time, and when there is warning or alarm.

    `limits` [dB] are those of warning and alarm.
    """
    gain, sigma, state = (run.column(name) for name in ("gain_margin_dB", "gain_margin_sigma_dB", "bounce"))
    frequency = run.column("bounce_frequency_Hz")
    if gain is None or sigma is None or state is None or frequency is None:
        return None
    chosen = spread_indices(len(run.time), _POINTS)
    time, (low, high) = run.time[chosen], edges(gain[chosen], sigma[chosen])
    settled = slice(len(chosen) // 10, None)
    shown = axis_range([low[settled], high[settled], np.array((0.0, *limits))], slice(None))
    true, correction = run.column(TRUE_MARGIN), run.column(CORRECTION[0])
    rows = [axis("gain margin [dB]", range=shown, weight=2.0), axis("frequency [Hz]")]
    rows += [] if correction is None else [axis("correction [°]")]
    figure = Figure(rows, time_axis(run.end), 300 + 50 * len(rows))
    for name, colour in _COLOURS.items():
        figure.add(*_stretches(time, state[chosen], name, colour, shown))
    figure.add(*band(time, low, high, "margin ± 2σ", "estimate-band"))
    figure.add(line(time, gain[chosen], "gain margin", "estimate", **hover("gain margin", "dB")))
    figure.add(line(time, frequency[chosen], "critical frequency", "violet", 1, **hover("critical frequency", "Hz")))
    if true is not None:
        look: Spec = {"line_dash": "dash", "zorder": 1}
        figure.add(line(time, true[chosen], "truth", "truth", **look, **hover("true gain margin", "dB")))
    if correction is not None:
        figure.add(line(time, np.degrees(correction[chosen]), "correction", "good", 2, **hover("correction", "°")))
    figure.level(0.0, *limits)
    figure.mark(run.changes)
    return figure


def _stretches(time: Array, state: Array, name: str, colour: str, shown: list[float] | None) -> list[Spec]:
    """Bars at the foot of the chart while it was so."""
    number = next(number for number, each in enum_names("lever_bounce").items() if each == name)
    if shown is None or not (state == number).any():
        return []
    foot = np.where(state == number, shown[0], np.nan)
    more: Spec = {"hovertemplate": f"{name}<extra></extra>", "connectgaps": False}
    return [line(time, foot, name, colour, line_width=10, **more)]
