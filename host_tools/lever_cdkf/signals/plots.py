"""Signals as small plots: lines of characters for a terminal, SVG in a page, or PNG."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..exports import pictures
from ..numeric.arrays import FloatArray, IntArray
from ..runtime.extras import require
from ..runtime.files import whole, write_text
from ..runtime.provenance import Provenance, with_provenance
from .recorded import Signal

_BLOCKS = "▁▂▃▄▅▆▇█"
_POINTS = 600
OTHER = "other"
"""Heading of what is no input."""
_WIDTH, _HEIGHT, _MARGIN, _BELOW = 640, 116, 84, 26
"""Of a plot in the page, with the room left of it for values and below it for times."""
_TICKS = 5


def sparkline(signal: Signal, width: int) -> str:
    """Return the means of `width` equal parts of its time, from least to greatest as eight heights.

    It is blank where there is no mean.
    """
    values = _parts(signal, width)[1]
    present = values[np.isfinite(values)]
    if not len(present):
        return " " * width
    low, span = float(present.min()), float(np.ptp(present)) or 1.0
    return "".join(_BLOCKS[min(int(8.0 * (each - low) / span), 7)] if math.isfinite(each) else " " for each in values)


KINDS = (".html", *(f".{kind}" for kind in pictures.KINDS))


def write(path: Path, signals: Sequence[tuple[str, Signal]], title: str, origin: Provenance) -> None:
    """Write a page (.html) or picture with each signal under its heading. Raise LeverError."""
    if path.suffix.lower() == ".html":
        write_text(path, with_provenance(_page(signals, title), origin))
        return
    content = pictures.render(_picture(signals, title), path.suffix.lower().removeprefix("."), title, origin)
    with whole(path) as target:
        target.write_bytes(content)


def _parts(signal: Signal, count: int) -> tuple[FloatArray, FloatArray]:
    """Return times and means of equal parts."""
    if not len(signal.time):
        return np.zeros(0), np.zeros(0)
    time, place = _places(signal, count)
    valid = np.isfinite(signal.values)
    counts = np.bincount(place[valid], minlength=count)
    return time, np.bincount(place[valid], signal.values[valid], count) / np.where(counts, counts, np.nan)


def _places(signal: Signal, count: int) -> tuple[FloatArray, IntArray]:
    """Return times of the middles of equal parts, from the first value on, and the part that each value is in."""
    first, last = float(signal.time[0]), float(signal.time[-1])
    place = ((signal.time - first) / max(last - first, 1e-9) * count).astype(np.int64)
    return (np.arange(count) + 0.5) * (last - first) / count, np.minimum(place, count - 1)


def _ranges(signal: Signal, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times of equal parts, with the least and the greatest value of each; NaN where there is none."""
    if not len(signal.time):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    time, place = _places(signal, count)
    valid = np.isfinite(signal.values)
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, place[valid], signal.values[valid])
    np.maximum.at(high, place[valid], signal.values[valid])
    empty = low > high
    low[empty] = high[empty] = np.nan
    return time, low, high


def _points(signal: Signal, most: int) -> int:
    """So few that a slow signal has a value in each: a line has no gaps then."""
    return max(min(most, len(signal.time) // 2), 1)


def _extremes(signal: Signal) -> str:
    present = signal.values[np.isfinite(signal.values)]
    if not len(present):
        return "no value"
    return f"{present.min():.4g} to {present.max():.4g} {signal.unit}".rstrip()


def _page(signals: Sequence[tuple[str, Signal]], title: str) -> str:
    figures, links = [], []
    begin = min((float(each.time[0]) for _, each in signals if len(each.time)), default=0.0)
    end = max((float(each.time[-1]) for _, each in signals if len(each.time)), default=1.0)
    for number, (heading, signal) in enumerate(signals):
        name = html.escape(signal.name)
        caption = f"<b>{html.escape(heading)}</b> {name}: {html.escape(_extremes(signal))}"
        figures.append(f'<figure id="s{number}"><figcaption>{caption}</figcaption>{_svg(signal, begin, end)}</figure>')
        links.append(f'<a href="#s{number}">{f"<b>{html.escape(heading)}</b> " if heading != OTHER else ""}{name}</a>')
    style = (
        ":root{color-scheme:light dark}body{font:15px/1.4 system-ui,sans-serif;max-width:84rem;margin:1rem auto;"
        "padding:0 1rem}main{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,28rem),1fr));"
        "gap:1rem 2rem}figure{margin:0;break-inside:avoid}figcaption{overflow-wrap:anywhere}"
        "nav{display:flex;flex-wrap:wrap;gap:.2rem 1rem;margin:0 0 1rem}figure:target{outline:2px solid #2a6fdb}"
        "svg{width:100%;height:auto;font-size:15px;fill:currentColor}"
        "path{fill:none;stroke:#2a6fdb;stroke-width:1.2;vector-effect:non-scaling-stroke}"
        "path.axis{stroke:#8888}"
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width"><style>{style}</style>'
        f"<h1>{html.escape(title)}</h1><nav>{''.join(links)}</nav><main>{''.join(figures)}</main></html>\n"
    )


def _svg(signal: Signal, begin: float, end: float) -> str:
    """Return the range that the values cover, in each part of the time of all.

    That is from `begin` to `end` [s], counted from `begin`.
    """
    time, lows, highs = _ranges(signal, _points(signal, _POINTS))
    present = np.isfinite(lows)
    low = float(lows[present].min()) if present.any() else 0.0
    span = (float(highs[present].max()) - low or 1.0) if present.any() else 1.0
    first = float(signal.time[0]) - begin if len(signal.time) else 0.0
    bottom, scale = _HEIGHT - _BELOW, (_WIDTH - _MARGIN - 20) / max(end - begin, 1e-9)
    path, pen = [], "M"
    for at, least, most in zip(time.tolist(), lows.tolist(), highs.tolist(), strict=True):
        if math.isfinite(least):
            ends = (bottom * (0.93 - 0.8 * (value - low) / span) for value in (least, most))
            path.append(f"{pen}{_MARGIN + scale * (first + at):.1f} {'V'.join(f'{end:.1f}' for end in ends)}")
        pen = "L" if math.isfinite(least) else "M"
    axis, texts = [f"M{_MARGIN} 0V{bottom}H{_WIDTH}"], []
    for tick in ticks(end - begin):
        x = _MARGIN + scale * tick
        axis.append(f"M{x:.1f} {bottom}v4")
        unit = "\u202fs" if tick else ""
        texts.append(f'<text x="{x:.1f}" y="{_HEIGHT - 6}" text-anchor="middle">{tick:g}{unit}</text>')
    for value, share in ((low, 0.93), (low + span, 0.13)):
        y = bottom * share + 5
        texts.append(f'<text x="{_MARGIN - 6}" y="{y:.1f}" text-anchor="end">{value:.3g}</text>')
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img"><path class="axis" d="{"".join(axis)}"/>'
        f'<path d="{"".join(path)}"/>{"".join(texts)}</svg>'
    )


def ticks(span: float) -> list[float]:
    """Round times from 0 to `span` [s], at most six of them."""
    least = max(span, 1e-9) / _TICKS
    power = 10.0 ** math.floor(math.log10(least))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))
    return [float(f"{step * k:.6g}") for k in range(int(1.001 * span / step) + 1)]


def _picture(signals: Sequence[tuple[str, Signal]], title: str) -> Any:
    """As a Figure of matplotlib."""
    require("study")
    from matplotlib.figure import Figure

    with pictures.style():
        return _drawn(Figure(layout="constrained"), signals, title)


def _drawn(figure: Any, signals: Sequence[tuple[str, Signal]], title: str) -> Any:
    figure.set_size_inches(pictures.WIDTHS["double"], 0.6 + 1.2 * len(signals))
    figure.suptitle(title)
    axes = figure.subplots(len(signals), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (heading, signal) in zip(axes, signals, strict=True):
        time, low, high = _ranges(signal, _points(signal, 4 * _POINTS))
        axis.plot(np.repeat(time, 2), np.column_stack((low, high)).ravel(), linewidth=0.7)
        axis.set_ylabel(signal.unit or "no unit")
        axis.set_title(f"{heading}: {signal.name}", fontsize="small", loc="left")
    axes[-1].set_xlabel("time [s]")
    return figure
