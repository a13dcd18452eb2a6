"""The plot of what estimate() has found, and what it shows as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..numeric.arrays import FloatArray

if TYPE_CHECKING:
    from .result import Estimated

_ROW = 1.2  # [inches]
_USUAL = (1.0, 99.0)  # percentiles of the values that an axis shows


def figure(time: FloatArray, shown: Sequence[Estimated], width: float) -> Any:
    """Return a chart for each quantity with its band of ±2 sigma, `width` [inches] wide, as a Figure of matplotlib."""
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(width, _ROW * len(shown)), layout="constrained")
    axes = sheet.subplots(len(shown), 1, sharex=True)
    for axis, each in zip(axes, shown, strict=True):
        axis.fill_between(time, each.values - 2.0 * each.sigma, each.values + 2.0 * each.sigma, alpha=0.25, linewidth=0)
        axis.plot(time, each.values, linewidth=1.0)
        axis.set_ylabel(each.name if each.unit == "1" else f"{each.name}\n[{each.unit}]")
        finite = each.values[np.isfinite(each.values)]
        if len(finite):
            low, high = np.percentile(finite, _USUAL)
            room = max(0.5 * float(high - low), 4.0 * each.last_sigma, 1e-9)
            axis.set_ylim(float(low) - room, float(high) + room)
    axes[-1].set_xlabel("time [s]")
    sheet.align_ylabels(axes)
    return sheet


def table(time: FloatArray, shown: Sequence[Estimated]) -> str:
    """CSV with a column for each quantity and its sigma; nothing where it is not known."""
    columns = {"time [s]": time}
    for each in shown:
        columns |= {f"{each.name} [{each.unit}]": each.values, f"{each.name}_sigma [{each.unit}]": each.sigma}
    numbers = np.column_stack(list(columns.values()))
    rows = (",".join(f"{value:.7g}" if np.isfinite(value) else "" for value in row) for row in numbers.tolist())
    return "\n".join([",".join(columns), *rows, ""])
