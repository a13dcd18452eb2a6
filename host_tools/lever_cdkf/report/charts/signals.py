"""What went in and how the lever moved: states, innovations, excitation, spectra."""

from typing import Any

import numpy as np

from ...firmware.quantities import DYNAMICS
from ...numeric.arrays import Array
from ...numeric.quantiles import chi_square_band
from ...results.whiteness import COLOURED
from ..figure import Figure, Spec, axis, axis_range, band, dots, frequency_axis, line, time_axis
from ..run import Run
from ..series import envelope, packed, spread_indices

DEGREES = 180.0 / np.pi
STATES = (("theta", "_rad", "angle θ [deg]"), ("theta_dot", "_rad_s", "rate θ̇ [deg/s]"))


def motion(run: Run) -> Figure | None:
    """Return angle and rate of the lever over the whole run."""
    rows = [axis(title) for _, _, title in STATES]
    figure = Figure(rows, time_axis(run.end), 420)
    for row, (key, suffix, _) in enumerate(STATES):
        for kind, colour in (("measured", "measured"), ("true", "truth"), ("estimate", "estimate")):
            values = run.column(f"{key}_{kind}{suffix}")
            if values is not None:
                name = "truth" if kind == "true" else kind
                figure.add(line(*envelope(run.time, DEGREES * values), name, colour, row, line_width=1))
    figure.mark(run.changes)
    return figure if figure.traces else None


def detail(run: Run, seconds: float = 2.0, points: int = 1000) -> Figure | None:
    """Return the same, close up: every sample of a few short stretches, chosen by button."""
    rows = [axis(title) for _, _, title in STATES]
    figure = Figure(rows, time_axis(seconds), 420, over_time=False)
    owners: list[int] = []
    starts = _stretches(run, seconds)
    for number, start in enumerate(starts.values()):
        close = run.close_up(start, seconds)
        chosen = spread_indices(len(close["time_s"]), points)
        for row, (key, suffix, _) in enumerate(STATES):
            for kind, draw in (("measured", dots), ("true", line), ("estimate", line)):
                column = f"{key}_{kind}{suffix}"
                if run.column(column) is not None:
                    name, more = _look(kind)
                    shown = {"visible": number == 0, "showlegend": row == 0}
                    colour = "measured" if kind == "measured" else name
                    x, y = close["time_s"][chosen], DEGREES * close[column][chosen]
                    figure.traces.append(draw(x, y, name, colour, row, **more, **shown))
                    owners.append(number)
    if not figure.traces:
        return None
    figure.choose(
        [
            {
                "label": label,
                "data": {"visible": [owner == number for owner in owners]},
                "layout": {"xaxis.range": [start, start + seconds]},
            }
            for number, (label, start) in enumerate(starts.items())
        ]
    )
    return figure


def _look(kind: str) -> tuple[str, dict[str, Any]]:
    return {
        "measured": ("measured", {}),
        "true": ("truth", {"line_dash": "dash", "line_width": 1.5}),
        "estimate": ("estimate", {}),
    }[kind]


def _stretches(run: Run, seconds: float) -> dict[str, float]:
    """Return label and start [s] of the stretches worth a close look."""
    last = max(0.0, run.end - seconds)
    starts = {"start": 0.0}
    if run.changes:
        starts["first change"] = min(max(0.0, run.changes[0] - 0.25 * seconds), last)
    starts["end"] = last
    return starts


def innovations(run: Run, seconds: float = 0.25) -> Figure | None:
    """Return the normalised innovation squared per output, averaged over short stretches.

    With it is the band that chance alone gives.
    """
    averages = run.innovations(seconds)
    if averages is None or not (filled := averages.freedom > 0).any():
        return None
    time, freedom, ratio = (
        averages.time[filled],
        averages.freedom[filled],
        averages.total[filled] / averages.freedom[filled],
    )
    low, high = np.array([chi_square_band(int(each)) for each in freedom]).T / freedom
    greatest = float(ratio.max())
    scale = {"type": "log"} if greatest > 10.0 else {"range": [0.0, max(2.0, 1.1 * greatest)]}
    figure = Figure([axis("NIS per output [1]", **scale)], time_axis(run.end), 280)
    figure.add(*band(time, low, high, "95 % if σ is right", "chance-band"))
    figure.add(dots(time, ratio, f"average over {averages.seconds:g} s", "estimate"))
    figure.mark(run.changes)
    return figure


def whiteness(run: Run) -> Figure | None:
    """Return autocorrelation of the residual of the rate with the band of chance and the limits of a right model."""
    result = run.whiteness
    if result is None:
        return None
    lag = 1000.0 * result.average_s * np.arange(1, len(result.autocorrelation) + 1)
    correlation = np.array(result.autocorrelation)
    end = float(lag[-1] + lag[0])
    limits = axis_range([np.append(correlation, (-0.25, 0.25))], slice(None))
    figure = Figure([axis("correlation [1]", range=limits)], axis("lag [ms]", range=[0.0, end]), 260, over_time=False)
    edges = np.full(2, result.band_of_all)
    figure.add(*band(np.array([0.0, end]), -edges, edges, "chance alone", "chance-band"))
    figure.level(-COLOURED, COLOURED)
    bar: Spec = {
        "type": "bar",
        "x": packed(lag),
        "y": packed(correlation),
        "name": "residual of the rate",
        "yaxis": "y",
    }
    figure.add(bar | {"width": 0.3 * float(lag[0]), "marker": {"color": "@estimate"}})
    return figure


def excitation(run: Run) -> Figure | None:
    """Return what shakes the lever: base acceleration, motor torque, and the estimator's own measure of the motion."""
    base = run.first_of("z_ddot_true_m_s2", "z_ddot_measured_m_s2")
    torque = run.first_of("tau_m_true_N_m", "tau_m_measured_N_m")
    level = run.column("excitation_rad_s")
    if base is None or torque is None:
        return None
    rows = [axis("base z̈ [m/s²]"), axis("torque τ<sub>m</sub> [N m]")]
    if level is not None:
        rows.append(axis("rms θ̇ [rad/s]", rangemode="tozero"))
    figure = Figure(rows, time_axis(run.end), 190 * len(rows))
    figure.add(line(*envelope(run.time, base), "base acceleration z̈", "base", 0, line_width=1))
    figure.add(line(*envelope(run.time, torque), "motor torque τ<sub>m</sub>", "torque", 1, line_width=1))
    if level is not None:
        figure.add(line(*envelope(run.time, level, 500), "motion seen by the estimator", "estimate", 2))
        least = np.full(2, run.settings["excitation_least"])
        ends = np.array([0.0, run.end])
        figure.add(line(ends, least, "least motion to learn from", "mark", 2, line_dash="dash", line_width=1.2))
    return figure


def spectra(run: Run) -> Figure | None:
    """At which frequencies base and motor shake the lever."""
    base = run.first_name("z_ddot_true_m_s2", "z_ddot_measured_m_s2")
    torque = run.first_name("tau_m_true_N_m", "tau_m_measured_N_m")
    figure = Figure([], frequency_axis(0.25, 50.0), 70, over_time=False)
    for column, name, title, colour in (
        (base, "base acceleration z̈", "z̈ [m/s² per √Hz]", "base"),
        (torque, "motor torque τ<sub>m</sub>", "τ<sub>m</sub> [N m per √Hz]", "torque"),
    ):
        frequency, power = run.spectrum(column) if column and run.samples >= 16 else (np.zeros(0), np.zeros(0))
        shown = (frequency >= 0.25) & (frequency <= 50.0)
        amplitude = np.sqrt(power[shown])
        if amplitude.any():
            figure.add(line(frequency[shown], _positive(amplitude), name, colour, len(figure.rows)))
            figure.rows.append(axis(title, type="log", dtick=1, exponentformat="none", range=_decades(amplitude)))
            figure.height += 175
    if not figure.rows:
        return None
    _mark_natural_frequency(run, figure)
    return figure


def _positive(values: Array) -> Array:
    return np.where(values > 0.0, values, np.nan)


def _decades(amplitude: Array) -> list[float]:
    """At most four decades below the peak: what lies deeper is numerical dust."""
    peak = float(np.log10(amplitude.max()))
    return [max(peak - 4.0, float(np.log10(amplitude[amplitude > 0.0].min())) - 0.1), peak + 0.2]


def _mark_natural_frequency(run: Run, figure: Figure) -> None:
    values = run.first_of("natural_frequency_true_Hz", "natural_frequency_estimate_Hz")
    if values is None or (limits := axis_range([values], run.settled, share=0.0)) is None:
        return
    low, high = limits
    box = {"type": "rect", "x0": low, "x1": max(high, 1.01 * low), "y0": 0, "y1": 1, "yref": "paper"}
    figure.shapes.append(box | {"fillcolor": "@chance-band", "line": {"width": 0}, "layer": "below"})
    where = {"x": float(np.log10(low * max(high, 1.01 * low)) / 2.0), "y": 0, "yref": "paper", "yanchor": "bottom"}
    figure.annotations.append(where | {"text": DYNAMICS[0].name, "showarrow": False})
