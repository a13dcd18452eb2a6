"""The Bode diagram of θ/z̈ as it changes in time: how far the lever moves for a shaking floor."""

from typing import Any, NamedTuple

import numpy as np

from ...firmware.quantities import DYNAMICS
from ...numeric.arrays import Array
from ...results.feedthrough import FREQUENCIES as SENT
from .. import bode
from ..bode import FREQUENCIES, SIGMAS, magnitude_and_phase
from ..figure import TICKS, Figure, Spec, axis, axis_range, band, frequency_axis, line, time_axis
from ..run import Run
from ..series import coarse, packed, spread_indices

TIMES = 200
SLICES = 25
ACCURACY_TIMES = 300
BAND: Array = FREQUENCIES[np.clip(FREQUENCIES, SENT[0], SENT[-1]) == FREQUENCIES]
DEGREES = 180.0 / np.pi


def _times(run: Run, count: int) -> np.ndarray:
    """Return indices of `count` samples, from the first estimate on."""
    estimates = run.first_of(*(quantity.column("estimate") for quantity in run.parameters))
    started = np.flatnonzero(np.isfinite(run.time if estimates is None else estimates))
    chosen: np.ndarray = started[spread_indices(len(started), count)]
    return chosen


def _responses(run: Run, chosen: np.ndarray, frequencies: Array) -> dict[str, np.ndarray]:
    """Return the responses [deg/(m/s²)] of truth and estimate at the samples, as far as they are known."""
    followed = run.followed_trim
    responses: dict[str, np.ndarray] = {}
    if followed is None:
        return responses
    true_trim = run.column("trim_true_rad")
    if (other := run.true_transfer(run.time[chosen])) is not None:
        responses["truth"] = DEGREES * other.response(frequencies)
    for name, columns, trim in (
        ("truth", [run.truth(q) for q in run.parameters], followed if true_trim is None else true_trim),
        ("estimate", [run.estimate(q) for q in run.parameters], followed),
    ):
        present = [column[chosen] for column in columns if column is not None]
        if len(present) == len(run.parameters):
            transfer = bode.transfer(run.model, run.lever, np.array(present), trim[chosen])
            responses[name] = DEGREES * transfer.response(frequencies)
    return responses


def maps(run: Run) -> dict[str, Figure]:
    """Return magnitude over time and frequency: a figure for "truth" and one for "estimate", in the same colours."""
    chosen = _times(run, TIMES)
    time, responses = run.time[chosen], _responses(run, chosen, FREQUENCIES)
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
        "z": packed(coarse(magnitude)),
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
    """Return magnitude and phase over frequency at one time, with a slider for the time, and the measured coherence."""
    chosen = _times(run, SLICES)
    time, responses = run.time[chosen], _responses(run, chosen, FREQUENCIES)
    if not responses:
        return None
    magnitudes = [np.abs(values) for values in responses.values()]
    phases = [magnitude_and_phase(curve)[1] for values in responses.values() for curve in values]
    decades = [np.log10(0.8 * np.nanmin(magnitudes)), np.log10(1.25 * np.nanmax(magnitudes))]
    rows = [
        axis("θ/z̈ [deg per m/s²]", type="log", range=[float(decade) for decade in decades], tickvals=TICKS),
        axis("phase [deg]", range=axis_range(phases, slice(None)), dtick=45),
    ]
    figure = Figure(rows, frequency_axis(FREQUENCIES[0], FREQUENCIES[-1]), 430, over_time=False)
    bands = _bands(run, time, responses["estimate"]) if "estimate" in responses else []
    shown = _shown(bands, len(time) * 4 // 5)
    for row, edges in enumerate(bands):
        figure.add(*band(BAND, *edges[shown], "estimate ± 2σ", "estimate-band", row))
    looks: dict[str, Spec] = {"truth": {"line_dash": "dash", "zorder": 1}, "estimate": {}}
    for name, values in responses.items():
        for row, curve in enumerate(magnitude_and_phase(values[shown])):
            figure.add(line(FREQUENCIES, curve, name, name, row, **looks[name]))
    steps = [
        _step(moment, [edge for edges in bands for edge in edges[index]], [each[index] for each in responses.values()])
        for index, moment in enumerate(time)
    ]
    figure.choose(steps, shown, slider="time")
    _add_coherence(run, figure)
    return figure


def _bands(run: Run, time: Array, estimate: np.ndarray) -> list[list[tuple[Array, Array]]]:
    """Return the low and high edge over BAND, of magnitude and of phase, at each time.

    Nothing where nothing was sent.
    """
    sent = run.feedthrough.at(time)
    if not np.isfinite(sent["gain_sigma"] + sent["phase_sigma"]).all(axis=1).any():
        return []
    inside = np.isin(FREQUENCIES, BAND)
    magnitudes, phases = [], []
    for curve, gain_sigma, phase_sigma in zip(estimate, sent["gain_sigma"], sent["phase_sigma"], strict=True):
        magnitude, phase = (values[inside] for values in magnitude_and_phase(curve))
        of_magnitude, of_phase = bode.bands(BAND, magnitude, phase, gain_sigma, phase_sigma)
        magnitudes.append(of_magnitude)
        phases.append(of_phase)
    return [magnitudes, phases]


def _shown(bands: list[list[tuple[Array, Array]]], wanted: int) -> int:
    """Return the time to begin with: the one nearest to `wanted` at which all of the band is known."""
    complete = [index for index, edges in enumerate(bands[0] if bands else []) if np.isfinite(edges).all()]
    return min(complete, key=lambda index: abs(index - wanted), default=wanted)


def _add_coherence(run: Run, figure: Figure) -> None:
    """Add a row for the measured coherence of the whole run, and for what chance alone would give."""
    measured = run.coherence
    if measured is None or measured.windows < 2:
        return
    frequency, coherence = measured.spectrum()
    inside = (frequency >= FREQUENCIES[0]) & (frequency <= FREQUENCIES[-1])
    figure.rows.append(axis("coherence [1]", range=[0.0, 1.05], weight=0.5))
    figure.height += 110
    row, ends = len(figure.rows) - 1, FREQUENCIES[[0, -1]]
    figure.add(line(frequency[inside], coherence[inside], "measured coherence", "measured", row))
    chance = np.full(2, measured.chance())
    figure.add(line(ends, chance, "95 % of chance alone", "mark", row, line_dash="dash", line_width=1.2))


def _short(number: float) -> float | None:
    return float(f"{number:.4g}") if np.isfinite(number) else None


def _step(moment: float, edges: list[Array], values: list[np.ndarray]) -> dict[str, Any]:
    curves = [*edges, *(curve for value in values for curve in magnitude_and_phase(value))]
    return {
        "label": f"{moment:.3g} s" if moment < 1000.0 else f"{moment:.0f} s",
        "data": {"y": [[_short(number) for number in curve] for curve in curves]},
        "traces": list(range(len(curves))),
    }


class Accuracy(NamedTuple):
    """Of θ/z̈ as it was sent, over its frequencies and the last two thirds of a run."""

    error: float
    """Complex error relative to the truth, rms [1]."""
    gain_covered: float
    """Part of the time that ±2σ holds the true magnitude [1]."""
    phase_covered: float


def accuracy(run: Run) -> Accuracy | None:
    """None where there is no truth, or nothing was sent."""
    chosen = _times(run, ACCURACY_TIMES)
    chosen = chosen[len(chosen) // 3 :]
    truth = _responses(run, chosen, SENT).get("truth")
    sent = run.feedthrough.at(run.time[chosen])
    if truth is None or not np.isfinite(sent["gain_sigma"]).any():
        return None
    ratio = DEGREES * sent["response"] / truth
    finite = np.isfinite(ratio * sent["gain_sigma"] * sent["phase_sigma"])
    gain = np.abs(np.log(np.abs(ratio)))[finite] <= SIGMAS * sent["gain_sigma"][finite]
    phase = np.abs(np.angle(ratio))[finite] <= SIGMAS * sent["phase_sigma"][finite]
    error = np.sqrt(np.mean(np.abs(ratio[finite] - 1.0) ** 2))
    return Accuracy(float(error), float(np.mean(gain)), float(np.mean(phase)))
