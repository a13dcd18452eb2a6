"""map.html: errors, coverage, consistency and settling over the design, with the border where tracking fails."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from lever_cdkf.host_tools.arrays import Array
from lever_cdkf.host_tools.report.figure import Spec, axis
from lever_cdkf.host_tools.report.page import Page
from lever_cdkf.host_tools.report.summary_html import table
from lever_cdkf.host_tools.tables import Row

from . import cells as statistics
from .border import Border
from .cells import Map, Runs, Scale
from .chunks import Plan
from .spec import Failure

_CELL, _TITLE, _FOOT = 170, 60, 60  # [pixels] of a chart, and above and below all
_GAP = 0.03  # between charts, at least, as part of the whole
_TICKS = 5  # of an axis, at most


@dataclass(frozen=True)
class Quantity:
    """What is mapped."""

    key: str
    title: str
    unit: str
    statistic: Callable[[Runs], float]
    scale: float
    range: tuple[float, float]
    caption: str


QUANTITIES = (
    Quantity(
        "error", "Error", "%", statistics.error, 100.0, (0.0, 50.0),
        "The largest rms error of a parameter in a run, relative to the truth: median over the runs of a cell; white "
        "where most failed.",
    ),
    Quantity(
        "coverage", "Coverage", "%", statistics.coverage, 100.0, (50.0, 100.0),
        "Share of the time for which ±2σ holds the truth, of the parameter that has the least: 95 % is right.",
    ),
    Quantity(
        "nees", "NEES", "", statistics.nees, 1.0, (0.0, 12.0),
        "Normalised squared error of the three parameters: 3 is right, more is over-confident.",
    ),
    Quantity(
        "settled", "Settling", "s", statistics.settled, 1.0, (0.0, 60.0),
        "Time until the error of the natural frequency stays within 5 %: median; empty where most runs never do.",
    ),
    Quantity(
        "flagged", "Flagged", "%", statistics.flagged, 100.0, (0.0, 100.0),
        "Share of the time with a fault that says that the estimates are not to be trusted.",
    ),
)  # fmt: skip


def build(plan: Plan, cells: Map, borders: Sequence[Border], rows: Sequence[Row], by_estimator: Sequence[Row]) -> str:
    """The whole page; `rows` of the border's table."""
    spec, length = plan.spec, f"{60.0 * plan.minutes:g}"
    page = Page(spec.title, f"{html.escape(spec.description)} {spec.runs:,} runs of {length} s.", "lever campaign")
    for quantity in QUANTITIES:
        if any(np.isfinite(_values(cells, quantity, name)).any() for name in cells.runs):
            caption = f"{quantity.caption} {_LINE}"
            drawn = page.figure(f"map-{quantity.key}", _figure(cells, borders, quantity), caption)
            page.section(quantity.key, quantity.title, quantity.title, drawn)
    page.section("border", "Border", "Where tracking fails", _table(rows))
    page.section("estimators", "Estimators", "All runs of each estimator", _table(by_estimator))
    return page.html(f'<p class="verdict">{_verdict(cells, spec.failure)}</p>')


def _verdict(cells: Map, failure: Failure) -> str:
    """In how many cells tracking holds."""
    held = {
        name: sum(
            not (statistics.error(each) > failure.error or statistics.coverage(each) < failure.coverage)
            for each in runs.values()
        )
        for name, runs in cells.runs.items()
    }
    count = max(len(runs) for runs in cells.runs.values())
    names = ", ".join(f"{name} in {number}" for name, number in held.items())
    return (
        f"Of {count} cells tracking holds with {names}. It counts as failed where the median error is above "
        f"{100.0 * failure.error:g} % or the coverage below {100.0 * failure.coverage:g} %."
    )


_LINE = "Line: the border where tracking fails, with its 95 % band."


def _table(rows: Sequence[Row]) -> str:
    header = [html.escape(column) for column in rows[0]] if rows else []
    return table(header, ([html.escape("" if cell is None else str(cell)) for cell in row.values()] for row in rows))


def _values(cells: Map, quantity: Quantity, estimator: str) -> Array:
    """(panels, y, x) in the unit of the quantity."""
    count = len(cells.panels.values)
    values = np.stack([cells.array(estimator, panel, quantity.statistic) for panel in range(count)])
    return np.where(np.isfinite(values), quantity.scale * values, np.nan)


def _figure(cells: Map, borders: Sequence[Border], quantity: Quantity) -> Spec:
    """A chart for each estimator (down) and panel (across)."""
    names, panels = list(cells.runs), len(cells.panels.values)
    height = _CELL * len(names) + _TITLE + _FOOT
    layout: Spec = {"height": height, "hovermode": "closest", "annotations": [], "showlegend": False}
    layout["margin"] = {"l": 70, "r": 12, "t": _TITLE, "b": _FOOT}
    data: list[Spec] = []
    for row, name in enumerate(names):
        values = _values(cells, quantity, name)
        for panel in range(panels):
            number = row * panels + panel + 1
            suffix = "" if number == 1 else str(number)
            across = _domain(panel, panels)
            down = _domain(len(names) - 1 - row, len(names))
            last, first = row == len(names) - 1, panel == 0
            x_axis = _axis(cells.x, ticks=last, title=last) | {"domain": across, "anchor": f"y{suffix}"}
            middle = first and row == len(names) // 2
            y_axis = _axis(cells.y, ticks=first, title=middle) | {"domain": down, "anchor": f"x{suffix}"}
            layout[f"xaxis{suffix}"], layout[f"yaxis{suffix}"] = x_axis, y_axis
            layout["annotations"].append(_heading(cells, name, panel, across, down))
            place = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
            data.append(_heat(cells, quantity, values[panel], number == 1) | place)
            own = [each for each in borders if each.estimator == name and each.panel == panel]
            data += [trace | place for trace in _border(cells, own)]
    return {"data": data, "layout": layout, "over_time": False}


def _domain(index: int, count: int) -> list[float]:
    gap = 0.0 if count == 1 else max(_GAP, 0.12 / count)
    width = (1.0 - gap * (count - 1)) / count
    return [index * (width + gap), index * (width + gap) + width]


def _axis(scale: Scale, *, ticks: bool, title: bool) -> Spec:
    places = _places(scale)
    shown = scale.shown(_TICKS)
    more: dict[str, Any] = {"showticklabels": ticks, "showgrid": False, "zeroline": False, "ticks": ""}
    more |= {"tickvals": places[shown].tolist(), "ticktext": [_number(scale.values[index]) for index in shown]}
    if scale.is_log:
        more["type"] = "log"
    return axis(html.escape(scale.label) if title else "", **more)


def _places(scale: Scale) -> Array:
    """Where plotly.js, which takes the logarithm itself, has the cells."""
    return scale.position if scale.is_named else np.array(scale.values, dtype=np.float64)


def _heading(cells: Map, name: str, panel: int, across: list[float], down: list[float]) -> Spec:
    value = cells.panels.values[panel]
    where = "" if value == "" else f", {cells.panels.label} {_number(value)}"
    place = {"x": across[0], "y": down[1], "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    return {"text": html.escape(f"{name}{where}"), "showarrow": False, "font": {"size": 11}} | place


def _heat(cells: Map, quantity: Quantity, values: Array, with_bar: bool) -> Spec:
    shown = [[None if math.isnan(value) else round(float(value), 3) for value in row] for row in values]
    bar = {"title": {"text": quantity.unit, "side": "top"}, "thickness": 10, "outlinewidth": 0, "len": 1.0}
    return {
        "type": "heatmap",
        "x": _places(cells.x).tolist(),
        "y": _places(cells.y).tolist(),
        "z": shown,
        "zmin": quantity.range[0],
        "zmax": quantity.range[1],
        "colorscale": "Viridis",
        "reversescale": quantity.key != "coverage",
        "showscale": with_bar,
        "colorbar": bar,
        "hovertemplate": f"%{{x:.3g}}, %{{y:.3g}}: %{{z:.3g}} {quantity.unit}<extra></extra>",
    }


def _border(cells: Map, borders: Sequence[Border]) -> list[Spec]:
    """The line and its band; beyond the map they run along its edge."""
    if len(borders) < 2 or cells.x.is_named:
        return []
    ends = [float(value) for value in (cells.x.values[0], cells.x.values[-1])]
    y = _places(cells.y)[[each.y for each in borders]]

    def clipped(values: Sequence[float]) -> list[float]:
        return [min(max(value, min(ends)), max(ends)) for value in values]

    low, high = clipped([each.low for each in borders]), clipped([each.high for each in borders])
    around = {"x": [*low, *reversed(high)], "y": [*y.tolist(), *reversed(y.tolist())]}
    middle = {"x": clipped([each.at for each in borders]), "y": y.tolist()}
    look = {"type": "scatter", "mode": "lines", "hoverinfo": "skip"}
    return [
        look | around | {"fill": "toself", "fillcolor": "rgba(230,60,60,0.25)", "line": {"width": 0}},
        look | middle | {"line": {"color": "rgb(230,60,60)", "width": 2.5}},
    ]


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.2g}"
