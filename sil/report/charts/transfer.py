"""The Bode diagram of θ/z̈ as it changes in time: how far the lever moves for a shaking floor."""

from typing import Any

import numpy as np

from ...quantities import DYNAMICS
from .. import bode
from ..bode import FREQUENCIES
from ..figure import TICKS, Figure, Spec, axis, axis_range, frequency_axis, line, time_axis
from ..run import Run
from ..series import Array, packed, spread_indices

TIMES = 200
SLICES = 25
DEGREES = 180.0 / np.pi


def _responses(run: Run, count: int) -> tuple[Array, dict[str, np.ndarray]]:
    """`count` times [s], and there the responses [deg/(m/s²)] of truth and estimate, as far as they are known.

    Times before the first estimate are left out.
    """
    known = run.first_of(*(quantity.column("estimate") for quantity in run.parameters))
    started = np.flatnonzero(np.isfinite(run.time if known is None else known))
    chosen = started[spread_indices(len(started), count)]
    followed = run.followed_trim
    found: dict[str, np.ndarray] = {}
    if followed is None:
        return run.time[chosen], found
    true_trim = run.column("trim_true_rad")
    if (other := run.true_transfer(run.time[chosen])) is not None:
        found["truth"] = DEGREES * other.response(FREQUENCIES)
    for name, columns, trim in (
        ("truth", [run.truth(q) for q in run.parameters], followed if true_trim is None else true_trim),
        ("estimate", [run.estimate(q) for q in run.parameters], followed),
    ):
        present = [column[chosen] for column in columns if column is not None]
        if len(present) == len(run.parameters):
            transfer = bode.transfer(run.model, run.lever, np.array(present), trim[chosen])
            found[name] = DEGREES * transfer.response(FREQUENCIES)
    return run.time[chosen], found


def maps(run: Run) -> dict[str, Figure]:
    """Magnitude over time and frequency: a figure for "truth" and one for "estimate", in the same colours."""
    time, responses = _responses(run, TIMES)
    magnitudes = {name: np.abs(values).T for name, values in responses.items()}
    reference = magnitudes.get("truth", magnitudes.get("estimate"))
    if reference is None:
        return {}
    brightest = float(np.nanmax(reference))
    return {name: _map(run, time, values, name, brightest) for name, values in magnitudes.items()}


def _map(run: Run, time: Array, magnitude: Array, name: str, brightest: float) -> Figure:
    figure = Figure([axis("frequency [Hz]", range=[FREQUENCIES[0], FREQUENCIES[-1]])], time_axis(run.end), 360)
    heat: Spec = {
        "type": "heatmap",
        "name": name,
        "x": packed(time),
        "y": packed(FREQUENCIES),
        "z": packed(magnitude),
        "zmin": 0.0,
        "zmax": brightest,
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": "deg per m/s²", "side": "right"}, "thickness": 12, "outlinewidth": 0},
        "hovertemplate": "%{x:.1f} s, %{y:.1f} Hz: %{z:.3f} deg per m/s²<extra></extra>",
    }
    figure.traces.append(heat)
    frequency = run.truth(DYNAMICS[0]) if name == "truth" else run.estimate(DYNAMICS[0])
    if frequency is not None:
        chosen = spread_indices(len(run.time), TIMES)
        more: Spec = {"line_width": 1.2, "showlegend": False, "hoverinfo": "skip"}
        figure.add(line(run.time[chosen], frequency[chosen], "natural frequency", "on-map", **more))
    return figure


def slices(run: Run) -> Figure | None:
    """Magnitude and phase over frequency at one time, with a slider for the time."""
    time, responses = _responses(run, SLICES)
    if not responses:
        return None
    magnitudes = [np.abs(values) for values in responses.values()]
    phases = [_curves(curve)[1] for values in responses.values() for curve in values]
    decades = [np.log10(0.8 * np.nanmin(magnitudes)), np.log10(1.25 * np.nanmax(magnitudes))]
    rows = [
        axis("θ/z̈ [deg per m/s²]", type="log", range=[float(decade) for decade in decades], tickvals=TICKS),
        axis("phase [deg]", range=axis_range(phases, slice(None)), dtick=45),
    ]
    figure = Figure(rows, frequency_axis(FREQUENCIES[0], FREQUENCIES[-1]), 520, over_time=False)
    shown = len(time) * 4 // 5
    looks: dict[str, Spec] = {"truth": {"line_dash": "dash"}, "estimate": {}}
    for name, values in responses.items():
        for row, curve in enumerate(_curves(values[shown])):
            figure.add(line(FREQUENCIES, curve, name, name, row, **looks[name]))
    steps = [_step(moment, [values[index] for values in responses.values()]) for index, moment in enumerate(time)]
    look = {"bgcolor": "@button", "bordercolor": "@quiet", "activebgcolor": "@estimate", "tickcolor": "@edge"}
    figure.more["sliders"] = [
        {"active": shown, "steps": steps, "currentvalue": {"prefix": "time ", "suffix": " s"}, "pad": {"t": 50}, **look}
    ]
    return figure


def _curves(values: np.ndarray) -> tuple[Array, Array]:
    """Magnitude, and phase [deg] that goes on downwards from -180 where the lever moves against the floor at first (the
    arm's weight does so), from 0 where it moves along."""
    start = -180.0 if values[0].real < 0.0 else 0.0
    along = values if start == 0.0 else -values
    return np.abs(values), np.degrees(np.unwrap(np.angle(along))) + start


def _short(number: float) -> float | None:
    return float(f"{number:.4g}") if np.isfinite(number) else None


def _step(moment: float, values: list[np.ndarray]) -> dict[str, Any]:
    curves = [[_short(number) for number in curve] for value in values for curve in _curves(value)]
    return {
        "label": f"{moment:.3g}" if moment < 1000.0 else f"{moment:.0f}",
        "method": "restyle",
        "args": [{"y": curves}],
    }
