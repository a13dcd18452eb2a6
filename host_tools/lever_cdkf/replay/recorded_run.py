"""A replay as the report reads it: reduced on the way, as a recording may be longer than memory."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ..numeric.arrays import FloatArray
from ..report.bode import LONGEST_STEP, slow_trim
from ..report.run import COHERENT, Averages, Run, nis_averages
from ..report.series import Welch
from ..results.coherence import Coherence
from ..results.feedthrough import Feedthrough
from ..results.nis import freedom
from ..results.ratios import TestRatios
from ..results.summary import ReplaySummary
from ..results.trace import Trace
from .reduction import Ends, Groups, Stretches

_CLOSE_UP = 2.0  # [s]
_NIS_AVERAGE = 0.25  # [s]
_MOST_AVERAGES = 2000
_SPECTRA = ("z_ddot_measured_m_s2", "tau_m_measured_N_m")


class Kept:
    """What is kept of the samples as they come."""

    def __init__(self, sample_period: float) -> None:
        self.sample_period = sample_period
        self.samples = 0
        self.end = 0.0
        """Time of the last sample [s]."""
        self.stretches = Stretches()
        self.ends = Ends(_CLOSE_UP)
        self.spectra = {name: Welch(sample_period) for name in _SPECTRA}
        self.feedthrough = Feedthrough()
        self.test_ratios = TestRatios()
        self.coherence = Coherence(sample_period)
        size = max(1, round(_NIS_AVERAGE / sample_period))
        self.nis = Groups(size, lambda time, nis, outputs: nis_averages(time, nis, outputs, size, _NIS_AVERAGE)[:3])

    def add(self, trace: Trace) -> None:
        """Further samples."""
        self.samples += len(trace["time_s"])
        self.end = float(trace["time_s"][-1])
        self.stretches.add(trace)
        self.ends.add(trace)
        outputs = freedom(trace["theta_measured_rad"], trace["theta_dot_measured_rad_s"]).astype(np.float64)
        self.nis.add(trace["time_s"], trace["nis"], outputs)
        for name, spectrum in self.spectra.items():
            spectrum.add(trace[name])
        self.feedthrough.add(trace)
        self.test_ratios.add(trace)
        self.coherence.add(*(trace[name] for name in COHERENT))


class RecordedRun(Run):
    """A Run of what was kept."""

    def __init__(self, kept: Kept, summary: ReplaySummary) -> None:
        super().__init__(kept.stretches.rows(), summary)
        self._kept = kept
        self.samples, self.end, self.sample_period = kept.samples, kept.end, kept.sample_period
        self.feedthrough, self.test_ratios, self.coherence = kept.feedthrough, kept.test_ratios, kept.coherence

    def close_up(self, start: float, seconds: float) -> Mapping[str, FloatArray]:
        """Return the columns of the trace near a time [s]."""
        return self._kept.ends.near(start)

    def innovations(self, seconds: float) -> Averages | None:
        """Longer stretches where a recording is long, so that there are no more than can be told apart."""
        groups = self._kept.nis.all()
        if groups is None:
            return None
        together = -(-len(groups[0]) // _MOST_AVERAGES)
        whole = len(groups[0]) // together * together
        time, total, outputs = (values[:whole].reshape(-1, together) for values in groups)
        return Averages(time.mean(axis=1), total.sum(axis=1), outputs.sum(axis=1), together * _NIS_AVERAGE)

    def spectrum(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return frequencies [Hz] and power spectral density of a column [unit²/Hz]."""
        return self._kept.spectra[name].spectrum()

    @cached_property
    def followed_trim(self) -> FloatArray | None:
        """In long stretches the mean of the lever's extremes stands for the slow part of its angle."""
        theta = self.first_of("theta_estimate_rad", "theta_measured_rad")
        if theta is None:
            return None
        if self._kept.stretches.size == 1:
            return slow_trim(self.time, theta, self.settings["trim_corner"])
        middle = 0.5 * (theta[0::2] + theta[1::2])
        if self._kept.stretches.size * self.sample_period > LONGEST_STEP:
            return np.repeat(middle, 2)
        return np.repeat(slow_trim(self.time[0::2], middle, self.settings["trim_corner"]), 2)
