"""Charts of the estimator's own state: its mode, its faults and how near others are, and the frames that were lost."""

import numpy as np

from ...firmware import native
from ...firmware.estimator import TEST_RATIOS
from ...numeric.arrays import Array
from ...numeric.stretches import runs
from ..figure import Figure, Spec, axis, hover, line, time_axis
from ..run import Run
from ..series import spread_indices

COUNTS = ("lost", "corrupt", "late")
LANE_POINTS = 1500  # how finely the bars are drawn
LEAST_SHARE = 0.002  # of the whole time: no bar is drawn shorter, or it could not be seen
RATIO_POINTS = 1000
RATIO_MOST = 3.0
RATIO_COLOURS = ("estimate", "base", "torque", "truth")
RATIO_DASHES = ("solid", "dash", "dot", "dashdot")
COUNT_COLOURS = {"lost": "estimate", "corrupt": "torque", "late": "base"}


def timeline(run: Run) -> Figure | None:
    """Return a row for each mode and each fault that occurred, with a bar whenever it was present.

    Below it are the counts.
    """
    mode, faults = run.column("mode"), run.column("faults")
    if mode is None or faults is None:
        return None
    bars = _modes(run, mode) + _faults(run, faults)
    names = [bar["name"] for bar in bars]
    lanes = axis("", type="category", categoryorder="array", categoryarray=names[::-1], showgrid=False, automargin=True)
    lanes["range"] = [-0.6, len(names) - 0.4]
    height = 110 + 26 * len(names)
    rows = [lanes | {"weight": 26.0 * len(names)}]
    counts = {name: values for name in COUNTS if (values := run.column(name)) is not None and np.nanmax(values) > 0.0}
    if counts:
        rows.append(axis("frames so far", rangemode="tozero", weight=130.0))
        height += 150
    figure = Figure(rows, time_axis(run.end), height)
    figure.traces += bars
    chosen = spread_indices(len(run.time), 1000)
    for name, values in counts.items():
        style = {"line_shape": "hv", "line_width": 1.5}
        figure.add(line(run.time[chosen], values[chosen], name, COUNT_COLOURS[name], 1, **style))
    figure.mark(run.changes)
    return figure


def test_ratios(run: Run) -> Figure | None:
    """Return each statistic that is watched over its threshold; None where they were not sent."""
    time = run.time[spread_indices(len(run.time), RATIO_POINTS)]
    ratios = run.test_ratios.at(time)
    if not np.isfinite(ratios).any():
        return None
    top = min(max(1.5, 1.1 * float(np.nanmax(ratios))), RATIO_MOST)
    figure = Figure([axis("test ratio [1]", range=[0.0, top])], time_axis(run.end), 360)
    for index, name in enumerate(TEST_RATIOS):
        words = name.replace("_", " ")
        colour, dash = RATIO_COLOURS[index % len(RATIO_COLOURS)], RATIO_DASHES[index // len(RATIO_COLOURS)]
        figure.add(line(time, ratios[:, index], words, colour, line_width=1.4, line_dash=dash) | hover(words))
    figure.add(line(np.array([0.0, run.end]), np.ones(2), "threshold", "mark", line_dash="dot", line_width=1.2))
    figure.mark(run.changes)
    return figure


def _modes(run: Run, mode: Array) -> list[Spec]:
    names = native.enum_names("lever_mode")
    present = [int(value) for value in np.unique(mode[np.isfinite(mode)])]
    named = [(value, f"mode: {names.get(value, value)}") for value in present]
    return [_bar(run, mode == value, name, name, "estimate") for value, name in named]


def _faults(run: Run, faults: Array) -> list[Spec]:
    bits, words = np.nan_to_num(faults).astype(np.int64), native.enum_words("lever_fault")
    return [
        _bar(run, (bits & value) != 0, f"fault: {name}", words[name], "fault")
        for value, name in native.enum_names("lever_fault").items()
        if np.any(bits & value)
    ]


def _bar(run: Run, active: np.ndarray, name: str, words: str, colour: str) -> Spec:
    """Draw each stretch in which something was so as a thick line that shows `words`; close stretches become one."""
    starts = spread_indices(len(active), LANE_POINTS)
    anywhere = np.logical_or.reduceat(active, starts)
    ends = np.append(run.time[starts[1:]], run.end)
    x: list[float | None] = []
    for first, last in runs(anywhere):
        start = float(run.time[starts[first]])
        x += [round(start, 4), round(max(float(ends[last]), start + LEAST_SHARE * run.end), 4), None]
    y = [name if moment is not None else None for moment in x]
    style = {"color": f"@{colour}", "width": 12}
    hover = {"hovertemplate": f"{words} %{{x:.2f}} s<extra></extra>", "showlegend": False}
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "name": name, "yaxis": "y", "line": style} | hover
