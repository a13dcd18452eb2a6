"""The picture of the estimator as tables of text, for a terminal or a file."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np
from rich.console import JustifyMethod
from rich.table import Table
from rich.text import Text

from . import status
from .paired import Measured
from .picture import STEP, Estimated, Picture
from .sources import Source
from .status import NOTHING, number

_BLOCKS = " ▁▂▃▄▅▆▇█"
_TREND_MEAN = 1.0  # [s] of the means that a trend is the difference of
_COLOURS = {"good": "green", "watch": "yellow", "bad": "bold red"}
_EXPECTED = ("LEVER_SAMPLE", "BASE_SAMPLE", "STATE_ESTIMATE", "HEALTH")  # messages
_UNIT = {"1": "", "N s/m": "N s/m", "1/s^2": "1/s²"}
_COLUMNS: tuple[tuple[JustifyMethod, int], ...] = (
    *(("left", 17), ("right", 8), ("right", 8)),
    *(("left", 6), ("right", 6), ("right", 9)),
)
_SCALE_WIDTH = 7
_FEEDTHROUGH_WIDTH, _FREQUENCY_WIDTH = 15, 7
ESTIMATES_WIDTH = sum(width + 1 for _, width in _COLUMNS)
"""Of estimates() without its sparkline."""


def headline(picture: Picture, source: Source) -> Text:
    """Return what is watched, since when, and how it stands."""
    minutes, seconds = divmod(int(picture.now), 60)
    model = f" · model {picture.model}" if picture.model else ""
    version = picture.identity.version
    firmware = f" · firmware {version}" if version else ""
    text = f"{source.title}{model} · watching for {minutes}:{seconds:02d} min{firmware}"
    return Text(text, style="bold")


def condition(picture: Picture, source: Source) -> Text:
    """Return how it stands, in a sentence."""
    level, text = status.of_source(picture, source)
    return Text(f"● {text}", style=_COLOURS[level])


def estimates(picture: Picture, span: float, width: int, lines: int = 1) -> Table:
    """Return parameters and dynamics with sigma, and how they went in the last `span` seconds; `width` [characters].

    With more than one of the `lines` each, the range of a chart stands beside it.
    """
    table = Table.grid(padding=(0, 1), pad_edge=False)
    chart_width = max(0, width - ESTIMATES_WIDTH - (_SCALE_WIDTH + 1 if lines > 1 else 0))
    for justify, column_width in _COLUMNS:
        table.add_column(justify=justify, width=column_width, no_wrap=True)
    for column_width in (chart_width, _SCALE_WIDTH)[: 1 if lines == 1 else 2]:
        table.add_column(width=column_width, no_wrap=True)
    titles = ("", "estimate", "± σ", "unit", "σ [%]", f"{span:.0f} s [%]", "trend" if chart_width > 5 else "")
    table.add_row(*(Text(title, style="dim") for title in titles))
    for entry in (*picture.parameters(), *picture.dynamics()):
        recent = _recent(picture, entry.key, span)
        bottom, top = map(number, _scale(recent, entry.sigma))
        table.add_row(
            Text(entry.key, style="bold"),
            Text(number(entry.value), style="bold"),
            f"± {number(entry.sigma, 2)}",
            _UNIT.get(entry.unit, entry.unit),
            number(100.0 * entry.sigma / abs(entry.value) if entry.value else math.nan, 2),
            _change(entry, recent),
            Text(sparkline(recent, entry.sigma, chart_width, lines), style="cyan"),
            *([Text(top + "\n" * (lines - 1) + bottom, style="dim")] if lines > 1 else []),
        )
    if not picture.parameters():
        table.add_row(Text("parameters", style="bold"), Text("none yet", style="dim"))
    return table


def feedthrough(picture: Picture, width: int) -> Table:
    """Return θ/z̈ of the estimate by frequency, with sigma, and the measured coherence of the two.

    It is a column a frequency, or a row where these are more than `width` [characters].
    """
    entries = picture.feedthrough()
    measured = picture.coherence()
    rows: list[tuple[str, list[str]]] = [
        ("gain [deg s²/m]", [number(math.degrees(abs(entry.response)), 3) for entry in entries]),
        ("± σ [%]", [number(100.0 * entry.gain_sigma, 2) for entry in entries]),
        ("phase [deg]", [number(_lag(entry.response), 3) for entry in entries]),
        ("± σ [deg]", [number(math.degrees(entry.phase_sigma), 2) for entry in entries]),
        ("coherence", [number(_at(measured, entry.frequency), 2) for entry in entries]),
    ]
    rows.insert(0, ("", [f"{entry.frequency} Hz" for entry in entries]))
    if _FEEDTHROUGH_WIDTH + len(entries) * (_FREQUENCY_WIDTH + 1) > width:
        first, *others = zip(*([title, *cells] for title, cells in rows), strict=True)
        return _grid([max(len(name) for name, *_ in others), *map(len, first[1:])], first, others)
    first, *others = ((title, *cells) for title, cells in rows)
    return _grid([_FEEDTHROUGH_WIDTH, *(_FREQUENCY_WIDTH for _ in entries)], first, others)


def _grid(widths: Sequence[int], head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Return columns of figures; the first one names the rows."""
    table = Table.grid(padding=(0, 1), pad_edge=False)
    for column, width in enumerate(widths):
        table.add_column(justify="right" if column else "left", width=width, no_wrap=True)
    table.add_row(*(Text(title, style="dim") for title in head))
    for name, *cells in rows:
        table.add_row(Text(name, style="bold"), *cells)
    return table


def _lag(response: complex) -> float:
    """Return the phase [deg] as the page has it, from -360 to 0.

    A lever lags the floor, or starts against it at -180.
    """
    return -(-math.degrees(cmath.phase(response)) % 360.0)


def _at(measured: Measured | None, frequency: float) -> float:
    return math.nan if measured is None else float(np.interp(frequency, measured.frequency, measured.coherence))


def sparkline(values: Sequence[float], least_range: float, width: int, lines: int = 1) -> str:
    """Return the values as bars of so many lines, oldest left, from the bottom to the top of _scale()."""
    chosen = [values[min(len(values) - 1, int((k + 0.5) * len(values) / width))] for k in range(width) if values]
    bottom, top = _scale(chosen, least_range)
    if math.isnan(bottom):
        return ""
    blocks = len(_BLOCKS) - 1
    steps = (lines * blocks - 1) / (top - bottom)
    levels = [1 + round((value - bottom) * steps) if math.isfinite(value) else 0 for value in chosen]
    below = range((lines - 1) * blocks, -1, -blocks)
    return "\n".join("".join(_BLOCKS[min(max(level - drawn, 0), blocks)] for level in levels) for drawn in below)


def _scale(values: Sequence[float], least_range: float) -> tuple[float, float]:
    """From the least to the greatest of the values, but no less than `least_range`; NaN where there are none."""
    finite = [value for value in values if math.isfinite(value)]
    if not finite:
        return math.nan, math.nan
    low, high = min(finite), max(finite)
    least = least_range if math.isfinite(least_range) else 0.0
    half = max(high - low, least, 1e-12 * max(abs(low), abs(high)), 1e-30) / 2.0
    return (low + high) / 2.0 - half, (low + high) / 2.0 + half


def health(picture: Picture, source: Source) -> Table:
    """Mode, faults in words, counts, and how well it can learn."""
    table = Table.grid(padding=(0, 1), pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    for name, text, level in status.facts(picture, source):
        table.add_row(name, Text(text, style=_COLOURS.get(level, "")))
    return table


def messages(picture: Picture) -> Table:
    """Return rates and losses of each message that has come."""
    table = Table.grid(padding=(0, 1), pad_edge=False)
    table.add_column(no_wrap=True)
    for _ in range(4):
        table.add_column(justify="right", no_wrap=True)
    table.add_row(*(Text(title, style="dim") for title in ("message", "[1/s]", "lost", "corrupt", "repeated")))
    for entry in picture.traffic.values():
        there = entry.heard is not None or entry.corrupt > 0
        if not (there or entry.name in _EXPECTED):
            continue
        cells = [f"{entry.rate:.0f}" if there and math.isfinite(entry.rate) else NOTHING]
        cells += [str(n) if there else NOTHING for n in (entry.lost, entry.corrupt, entry.repeated)]
        bad = entry.lost or entry.corrupt or entry.repeated
        table.add_row(entry.name, *cells, style="yellow" if bad else "" if there else "dim")
    return table


def _recent(picture: Picture, key: str, span: float) -> list[float]:
    column = picture.history.get(key, ())
    return list(column)[-max(1, round(span / STEP)) :]


def _change(entry: Estimated, recent: Sequence[float]) -> str:
    """By how much it has changed [%], with an arrow where that is more than its sigma."""
    few = max(1, round(_TREND_MEAN / STEP))
    finite = [value for value in recent if math.isfinite(value)]
    if len(finite) < 2 * few or not entry.value or not math.isfinite(entry.value):
        return NOTHING
    difference = sum(finite[-few:]) / few - sum(finite[:few]) / few
    arrow = "→" if not abs(difference) > entry.sigma else "↗" if difference > 0.0 else "↘"
    return f"{100.0 * difference / abs(entry.value):+.1f} {arrow}"
