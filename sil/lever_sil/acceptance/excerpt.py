"""A flight for a chart: one quantity, its truth, and where the firmware says that it is not to be trusted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from lever_cdkf.report.figure import Figure, axis, band, dots, edges, line, time_axis

_MARGIN = 0.15  # of the y axis, beyond what 98 % of the values reach
_NO_TRUTH = 2.0  # [Hz] of f_n: what is below is the lever alone, without an arm

TITLES = {"f_n": "natural frequency [Hz]", "zeta": "damping ratio", "m_p": "m_p [kg]", "c_p": "c_p [N s/m]",
          "k_p": "k_p [N/m]"}  # fmt: skip
"""Titles of the y axis by quantity."""


@dataclass(frozen=True)
class Excerpt:
    """Columns at a few hundred times."""

    quantity: str
    """A key of TITLES."""
    time: FloatArray
    """[s]"""
    truth: FloatArray
    """Empty for a pilot that has none."""
    value: FloatArray
    sigma: FloatArray
    flagged: BoolArray

    def chart(self, sigmas: float, moments: Iterable[float]) -> Figure:
        """Return the estimate with a band of so many standard deviations, over time.

        There are dots at the foot where it is flagged, and lines at the moments [s].
        """
        floor, ceiling = self._limits()
        figure = Figure(
            [axis(TITLES[self.quantity], range=[floor, ceiling])], time_axis(float(self.time[-1])), height=260
        )
        around = edges(self.value, self.sigma, 0.0, sigmas=sigmas)
        figure.add(*band(self.time, *around, f"estimate ± {sigmas:g}σ", "estimate-band"))
        if self.truth.size:
            figure.add(line(self.time, self.truth, "truth", "truth", line_dash="dash", zorder=1))
        figure.add(line(self.time, self.value, "estimate", "estimate"))
        if self.flagged.any():
            at = self.time[self.flagged]
            figure.add(dots(at, np.full(at.shape, floor + 0.02 * (ceiling - floor)), "flagged", "fault"))
        figure.mark(list(moments))
        return figure

    def _limits(self) -> tuple[float, float]:
        truth = self.truth[self.truth > _NO_TRUTH] if self.quantity == "f_n" else self.truth
        values = np.concatenate((truth, self.value))
        values = values[np.isfinite(values)]
        if not values.size:
            return 0.0, 1.0
        return (1.0 - _MARGIN) * float(np.percentile(values, 1.0)), (1.0 + _MARGIN) * float(np.percentile(values, 99.0))
