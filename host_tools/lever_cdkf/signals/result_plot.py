"""The plot of what estimate() has found, and what it shows as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..numeric.arrays import FloatArray
from ..report.figure import Figure, Spec, axis, band, edges, line, time_axis

if TYPE_CHECKING:
    from .result import Estimated

_USUAL = (1.0, 99.0)  # percentiles of the values that an axis shows


def figure(time: FloatArray, shown: Sequence[Estimated]) -> Figure:
    """Return a chart for each quantity with its band of ±2 sigma."""
    drawn = Figure([_axis(each) for each in shown], time_axis(float(time[-1])))
    for row, each in enumerate(shown):
        around = edges(each.values, each.sigma, each.least)
        drawn.add(*band(time, *around, "estimate ± 2 standard deviations", "estimate-band", row))
        drawn.add(line(time, each.values, "estimate", "estimate", row))
    return drawn


def _axis(each: Estimated) -> Spec:
    title = each.name if each.unit == "1" else f"{each.name}\n[{each.unit}]"
    finite = each.values[np.isfinite(each.values)]
    if not len(finite):
        return axis(title)
    low, high = np.percentile(finite, _USUAL)
    room = max(0.5 * float(high - low), 4.0 * each.last_sigma, 1e-9)
    return axis(title, range=[max(float(low) - room, each.least), float(high) + room])


def table(time: FloatArray, shown: Sequence[Estimated]) -> str:
    """CSV with a column for each quantity and its sigma; nothing where it is not known."""
    columns = {"time [s]": time}
    for each in shown:
        columns |= {f"{each.name} [{each.unit}]": each.values, f"{each.name}_sigma [{each.unit}]": each.sigma}
    numbers = np.column_stack(list(columns.values()))
    rows = (",".join(f"{value:.7g}" if np.isfinite(value) else "" for value in row) for row in numbers.tolist())
    return "\n".join([",".join(columns), *rows, ""])
