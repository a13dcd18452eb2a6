"""map.svg: the error over the design with the border, for print."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from lever_cdkf.host_tools.arrays import Array

from .border import Border
from .cells import Map, Scale, error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH, _CELL = 7.16, 1.35  # [inches]: both columns of IEEE's; a chart
_MOST = 50.0  # [%] of the colours
_TICKS = 4  # of an axis, at most


def build(cells: Map, borders: Sequence[Border]) -> str:
    """The picture; the same cells give the same text."""
    import matplotlib
    import matplotlib.style
    from matplotlib.figure import Figure as Sheet

    names, panels = list(cells.runs), len(cells.panels.values)
    with matplotlib.style.context(["default", {"font.size": 7.0, "svg.hashsalt": "lever", "svg.fonttype": "none"}]):
        sheet = Sheet(figsize=(_WIDTH, 0.7 + _CELL * len(names)), layout="constrained")
        charts = sheet.subplots(len(names), panels, sharex=True, sharey=True, squeeze=False)
        for row, name in enumerate(names):
            for panel in range(panels):
                chart = charts[row, panel]
                values = 100.0 * cells.array(name, panel, error)
                colours = chart.pcolormesh(
                    _edges(cells.x),
                    _edges(cells.y),
                    np.ma.masked_invalid(values),
                    cmap="viridis_r",
                    vmin=0.0,
                    vmax=_MOST,
                )
                _draw(chart, cells, [each for each in borders if each.estimator == name and each.panel == panel])
                _label(chart, cells, name, panel)
        sheet.supxlabel(cells.x.label)
        sheet.supylabel(cells.y.label)
        sheet.colorbar(colours, ax=charts, label="rms error of the worst parameter [%]", extend="max", aspect=30)
        file = io.StringIO()
        sheet.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def _edges(scale: Scale) -> Array:
    """Of the cells, in positions."""
    at = scale.position if len(scale.values) > 1 else np.zeros(1)
    if len(at) == 1:
        return np.array([-0.5, 0.5])
    middle = 0.5 * (at[1:] + at[:-1])
    return np.concatenate(([2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]))


def _draw(chart: Axes, cells: Map, own: Sequence[Border]) -> None:
    if len(own) < 2:
        return
    y = cells.y.position[[each.y for each in own]]
    ends = np.sort(cells.x.position[[0, -1]])

    def at(values: Sequence[float]) -> Array:
        positions = np.array([_position(cells.x, value) for value in values])
        clipped: Array = np.clip(positions, *ends)
        return clipped

    low, high = at([each.low for each in own]), at([each.high for each in own])
    chart.fill_betweenx(y, low, high, color="#e63c3c", alpha=0.3, linewidth=0.0)
    chart.plot(at([each.at for each in own]), y, color="#e63c3c", linewidth=1.4)


def _position(scale: Scale, value: float) -> float:
    return float(np.log(value)) if scale.is_log and np.isfinite(value) else value


def _label(chart: Axes, cells: Map, name: str, panel: int) -> None:
    value = cells.panels.values[panel]
    chart.set_title(name if value == "" else f"{name}, {cells.panels.label} {value:.3g}", fontsize=6.5, loc="left")
    for scale, set_ticks in ((cells.x, chart.set_xticks), (cells.y, chart.set_yticks)):
        texts = [each if isinstance(each, str) else f"{each:.2g}" for each in scale.values]
        shown = scale.shown(_TICKS)
        set_ticks(scale.position[shown], [texts[index] for index in shown])
