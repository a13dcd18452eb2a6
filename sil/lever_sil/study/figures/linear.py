"""The linear models: excitation and response, reconstruction of states, reconstruction of parameters.

The position x [m] and its rate are what the samples carry as theta and theta_dot, the force f [N] what they carry as
motor torque: see firmware/model/linear_physical.c.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from lever_cdkf.firmware.config import setting
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from ...measures import covered, rms
from ..data import Batch
from ..matched import KINDS, PRIOR, Condition, matched
from .description import Column, Curve, Figure, Points, Row, Trace, interval, number, percent, tracked
from .runs import WILD, Extent, estimates, late, matched_config, shown

_PRIOR = {**PRIOR["linear_physical"], "lever_preload_angle": 0.0}
_FORCE = 2.0  # [N] rms: in the acceleration of the mass about what the base does
_PROCESS_NOISE = 0.1  # [m/s/√s]: twice the default, so that it can be seen
_NOISY = Condition(
    "linear_physical", "fixed", dither_rms=_FORCE, settings=_PRIOR | {"theta_dot_process_noise": _PROCESS_NOISE}
)
_CONDITIONS = (
    Condition("linear_physical", "fixed", dither_rms=_FORCE, settings=_PRIOR),
    Condition("linear_black_box", "fixed", settings={"lever_preload_angle": 0.0}),
)
_SYMBOLS = {"a21": "a_21", "a22": "a_22", "b21": "b_21"}
_EXCERPT = 2.0  # [s]
_MILLI = 1e3


def excitation(seed: int, extent: Extent) -> Figure:
    """Draw inputs and outputs of a linear system with process noise, and what it does without that noise."""
    batch = matched(_NOISY, 1, extent.duration, seed)
    silent = dataclasses.replace(_NOISY, settings={**_NOISY.settings, "theta_dot_process_noise": 0.0})
    quiet = matched(silent, 1, extent.duration, seed)  # the same inputs, parameters and output noise
    time, window = _excerpt(batch)
    u = batch.u[0, window]
    rows = (
        Row("z̈ [m/s²]", (Curve(time, u[:, 0], "truth", "signal"),)),
        Row("f [N]", (Curve(time, u[:, 1], "truth", "signal"),)),
        Row("x [mm]", _response(time, batch, quiet, window, 0)),
        Row("ẋ [mm/s]", _response(time, batch, quiet, window, 1)),
    )
    caption = _excitation_caption(batch, quiet)
    title = "Linear system with process noise"
    return Figure("excitation", title, caption, (Column("", rows),), _excerpt_range(batch), row_height=0.85)


def _response(time: Array, batch: Batch, quiet: Batch, window: NDArray[np.int64], state: int) -> tuple[Trace, ...]:
    return (
        Points(time, _MILLI * batch.raw_y[0, window, state], "measured", "measured"),
        Curve(time, _MILLI * batch.truth.x[0, window, state], "truth", "signal"),
        Curve(time, _MILLI * quiet.truth.x[0, window, state], "without process noise", "without"),
    )


def _excitation_caption(batch: Batch, quiet: Batch) -> str:
    moved = _MILLI * batch.truth.x[0, :, 0]
    process = moved - _MILLI * quiet.truth.x[0, :, 0]
    noise = _MILLI * (batch.raw_y[0, :, 0] - batch.truth.x[0, :, 0])
    return (
        "A mass on a spring and a damper (linear physical model), shaken by its base (z̈) and by a known force (f), "
        "both measured without error here, and by process noise, which nobody knows. Solid is the truth, dots are what "
        "is measured, dashed is what the same system would do without process noise. Over the whole run the "
        f"position moves by {number(rms(moved))} mm rms, of which process noise makes {number(rms(process))} mm; a "
        f"measurement is off by {number(rms(noise))} mm rms. Shown are the last {number(_EXCERPT)} s."
    )


def states(seed: int, extent: Extent) -> Figure:
    """Draw states of a linear system with process noise as the firmware reconstructs them, and its errors."""
    batch = matched(_NOISY, 1, extent.duration, seed)
    estimated = estimates(matched_config(_NOISY, "dual"), batch)
    time, window = _excerpt(batch)
    rows: list[Row] = []
    sentences: list[str] = []
    for index, (column, symbol, unit) in enumerate((("theta", "x", "mm"), ("theta_dot", "ẋ", "mm/s"))):
        truth, measured = _MILLI * batch.truth.x[0, :, index], _MILLI * batch.raw_y[0, :, index]
        estimate, sigma = _MILLI * estimated[column], _MILLI * estimated[f"{column}_sigma"]
        rows += _state_rows(time, window, f"{symbol} [{unit}]", (truth, measured, estimate, sigma))
        settled = late(np.arange(batch.samples, dtype=np.float64))
        off, noise = rms((estimate - truth)[settled]), rms((measured - truth)[settled])
        inside = float(covered((estimate - truth)[settled], sigma[settled]))
        sentences.append(f"{symbol} {number(off)} {unit} rms against {number(noise)} {unit}, {percent(inside, 3)} held")
    caption = (
        "Position and rate of the linear physical model with process noise as the firmware reconstructs them (dual "
        "filter, which learns the parameters meanwhile), and below each its error with the band of ±2σ that it states "
        "itself. In the second half of the run, error of the estimate against that of a measurement, and share of the "
        f"errors within the band (95 % if σ is right): {'; '.join(sentences)}. Shown are the last {number(_EXCERPT)} s."
    )
    columns = (Column("", tuple(rows)),)
    return Figure("states", "State reconstruction", caption, columns, _excerpt_range(batch), row_height=0.9)


def _state_rows(
    time: Array, window: NDArray[np.int64], label: str, columns: tuple[Array, Array, Array, Array]
) -> tuple[Row, Row]:
    truth, measured, estimate, sigma = (column[window] for column in columns)
    return (
        Row(
            label,
            (
                Points(time, measured, "measured", "measured"),
                Curve(time, estimate, "estimate", "estimate"),
                Curve(time, truth, "truth", "truth"),
            ),
        ),
        Row(
            f"error of {label}",
            (
                interval(time, np.zeros_like(sigma), sigma, "±2σ", "estimate-band"),
                Curve(time, estimate - truth, "estimate", "estimate"),
            ),
        ),
    )


def parameters(seed: int, extent: Extent) -> Figure:
    """Draw parameters of both linear models as the firmware reconstructs them."""
    parts = [part for condition in _CONDITIONS for part in _parameters(condition, seed, extent)]
    caption = (
        "Parameters of the linear physical model (m, c, k; shaken by its base and by a force of "
        f"{number(_FORCE)} N rms, without which only c/m and k/m could be told) and of the linear black box "
        "(a_21, a_22, b_21; base only), from the firmware's dual filter. The truth is a random walk; the estimate "
        "starts at a first guess that is wrong by chance, and its band of ±2σ narrows to what excitation and drift "
        "allow. Rms error in the second half of the run, and in brackets the share of the run in which the band holds "
        f"the truth: {', '.join(sentence for _, sentence in parts)}. The axes are scaled to what follows the first "
        f"{number(WILD * extent.duration)} s."
    )
    title, end = "Linear parameter reconstruction", extent.duration
    columns = (Column("", tuple(row for row, _ in parts)),)
    return Figure("parameters", title, caption, columns, (0.0, end), scaled_from=WILD * end, row_height=0.8)


def _parameters(condition: Condition, seed: int, extent: Extent) -> list[tuple[Row, str]]:
    """Return a chart of each parameter of one model, and what there is to say of it."""
    batch = matched(condition, 1, extent.duration, seed)
    at = shown(batch)
    time, settled = at * batch.period, late(at.astype(np.float64))
    estimated = estimates(matched_config(condition, "dual"), batch, at=at)
    assert batch.truth.p is not None
    parts: list[tuple[Row, str]] = []
    for index, name in enumerate(KINDS[condition.model].parameters):
        symbol, unit = _SYMBOLS.get(name, name), setting(name).unit.replace("^2", "²")
        truth, estimate = batch.truth.p[0, at, index], estimated["parameter"][:, index]
        sigma, off = estimated["parameter_sigma"][:, index], rms((estimate - truth)[settled])
        row = Row(f"{symbol} [{unit}]", tracked(time, truth, estimate, sigma))
        parts.append((row, f"{symbol} {_with_unit(off, unit)} ({percent(float(covered(estimate - truth, sigma)), 3)})"))
    return parts


def _with_unit(value: float, unit: str) -> str:
    return number(value) if unit == "1" else f"{number(value)} {unit}"


def _excerpt(batch: Batch) -> tuple[Array, NDArray[np.int64]]:
    """Return times [s] and indices of the samples at the end of a run."""
    window = np.arange(max(0, batch.samples - round(_EXCERPT / batch.period)), batch.samples, dtype=np.int64)
    return window * batch.period, window


def _excerpt_range(batch: Batch) -> tuple[float, float]:
    end = batch.samples * batch.period
    return max(0.0, end - _EXCERPT), end
