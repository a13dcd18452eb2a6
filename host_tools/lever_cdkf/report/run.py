"""What a run left behind, as the charts read it: columns that may be absent, and what follows from several of them."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..firmware import native, quantities
from ..firmware.quantities import Quantity
from ..models.lever import Lever
from ..models.transfer import Transfer
from ..numeric.arrays import Array, BoolArray
from ..results import whiteness
from ..results.coherence import Coherence
from ..results.faults import OPTIONAL, warning_bits
from ..results.feedthrough import Feedthrough
from ..results.ratios import TestRatios
from ..results.summary import RecordingSummary, ReplaySummary, SimulationSummary, Summary
from ..results.trace import MEASURED
from ..results.whiteness import Whiteness
from .bode import slow_trim
from .series import jumps, welch

COHERENT = ("z_ddot_measured_m_s2", "theta_measured_rad")
"""Columns of which the coherence is shown."""


class Averages(NamedTuple):
    """NIS over stretches of `seconds` [s]: mean time [s], sum of NIS, and how many outputs are in it."""

    time: Array
    total: Array
    freedom: Array
    seconds: float


class Run:
    """A trace (columns of trace.csv) and its summary (summary.json), where there is one."""

    def __init__(self, trace: Mapping[str, NDArray[Any]], summary: Summary | None) -> None:
        self.trace = trace
        self.summary = summary
        self.simulated = summary if isinstance(summary, SimulationSummary) else None
        self.replayed = summary if isinstance(summary, ReplaySummary) else None
        self.time: Array = np.asarray(trace["time_s"], dtype=np.float64)

    def column(self, name: str) -> Array | None:
        """Return a column, or None when it is absent or holds no value at all."""
        if name not in self.trace:
            return None
        values: Array = np.asarray(self.trace[name], dtype=np.float64)
        return values if np.isfinite(values).any() else None

    def first_of(self, *names: str) -> Array | None:
        """Return the first of several columns that is there."""
        name = self.first_name(*names)
        return None if name is None else self.column(name)

    def first_name(self, *names: str) -> str | None:
        """Return its name."""
        return next((name for name in names if self.column(name) is not None), None)

    def truth(self, quantity: Quantity) -> Array | None:
        """Return the true values of a quantity; None where they are not known."""
        return self.column(quantity.column("true"))

    def estimate(self, quantity: Quantity) -> Array | None:
        """Return the estimates of a quantity; None without any."""
        return self.column(quantity.column("estimate"))

    def sigma(self, quantity: Quantity) -> Array | None:
        """Return their standard deviations; None without any."""
        return self.column(quantity.column("sigma"))

    @cached_property
    def model(self) -> str:
        """The estimator's model: as the summary tells, or without one as the columns do."""
        models = native.enum_names("lever_model").values()
        seen = (model for model in models if quantities.parameters(model)[0].column("estimate") in self.trace)
        return self.summary.estimator.model if self.summary else next(seen, native.Config().choices["model"])

    @property
    def recording(self) -> RecordingSummary | None:
        """What was in the log that was replayed; None for a simulation."""
        return self.replayed.recording if self.replayed else None

    @property
    def parameters(self) -> tuple[Quantity, ...]:
        """What the estimator's model has to be estimated."""
        return quantities.parameters(self.model)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What the model estimates."""
        return quantities.quantities(self.model)

    @cached_property
    def mismatch(self) -> str | None:
        """The truth's model where it is another than the estimator's."""
        return self.simulated.truth.model if self.simulated and self.simulated.truth.model != self.model else None

    @property
    def about_truth(self) -> str:
        """What the truth is, where it is not of the estimator's model."""
        return (self.simulated and self.simulated.truth.about) or ""

    @property
    def about_true_dynamics(self) -> str:
        """What its natural frequency is, where that needs saying."""
        return (self.simulated and self.simulated.truth.about_dynamics) or ""

    @cached_property
    def whiteness(self) -> Whiteness | None:
        """As the summary tells, or without one of the whole trace; None where there is nothing to tell from."""
        if self.summary is not None:
            return self.summary.whiteness
        residual = whiteness.residual(self.trace)
        return None if residual is None else whiteness.measure(residual, self.sample_period)

    def true_transfer(self, time: Array) -> Transfer | None:
        """θ/z̈ of a truth that is not of the estimator's model, at the times [s]; None where the summary has none."""
        transfer = self.simulated.truth.transfer if self.simulated else None
        if transfer is None:
            return None
        at = np.maximum(np.searchsorted(transfer.time_s, time, side="right") - 1, 0)
        return Transfer(np.array(transfer.numerator)[at], np.array(transfer.denominator)[at])

    # What takes every sample to tell; a run that has kept fewer overrides these.

    @cached_property
    def samples(self) -> int:
        """How many there were."""
        return len(self.time)

    def close_up(self, start: float, seconds: float) -> Mapping[str, Array]:
        """Return every column at every sample of a stretch [s]."""
        inside = (self.time >= start) & (self.time <= start + seconds)
        return {name: np.asarray(values)[inside] for name, values in self.trace.items()}

    def innovations(self, seconds: float) -> Averages | None:
        """Return the innovations of stretches of about `seconds` [s]; None without NIS."""
        nis = self.column("nis")
        if nis is None:
            return None
        size = max(1, round(seconds / self.sample_period))
        return nis_averages(self.time, nis, self._outputs(), size, seconds)

    def spectrum(self, name: str) -> tuple[Array, Array]:
        """Return frequencies [Hz] and power spectral density of a column."""
        return welch(np.asarray(self.trace[name], dtype=np.float64), self.sample_period)

    @cached_property
    def feedthrough(self) -> Feedthrough:
        """θ/z̈ as the estimator sent it; empty where the trace has none."""
        kept = Feedthrough()
        kept.add(self.trace)
        return kept

    @cached_property
    def test_ratios(self) -> TestRatios:
        """As the estimator sent them; empty where the trace has none."""
        kept = TestRatios()
        kept.add(self.trace)
        return kept

    @cached_property
    def coherence(self) -> Coherence | None:
        """Measured, of z̈ and θ; None where one was not."""
        base, theta = (self.column(name) for name in COHERENT)
        if base is None or theta is None:
            return None
        measured = Coherence(self.sample_period)
        measured.add(base, theta)
        return measured

    @cached_property
    def followed_trim(self) -> Array | None:
        """The estimator's own idea of the trim angle [rad]."""
        theta = self.first_of("theta_estimate_rad", "theta_measured_rad")
        return None if theta is None else slow_trim(self.time, theta, self.settings["trim_corner"])

    def _outputs(self) -> Array:
        """Return how many outputs each sample had."""
        names = ("theta_measured_rad", "theta_dot_measured_rad_s")
        return sum(
            (np.isfinite(self.trace[name]).astype(float) for name in names if name in self.trace),
            start=np.full(len(self.time), float(sum(name not in self.trace for name in names))),
        )

    # ---

    @cached_property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.time[-1])

    @cached_property
    def has_truth(self) -> bool:
        """Of anything that is estimated."""
        return any(self.truth(quantity) is not None for quantity in self.quantities)

    @cached_property
    def flagged(self) -> BoolArray:
        """At which rows the estimator said not to trust its estimates; inputs that were never measured do not count."""
        faults = self.column("faults")
        if faults is None:
            return np.zeros(len(self.time), bool)
        columns = {key: column for column, _, key in MEASURED}
        without = tuple(fault for fault, key in OPTIONAL.items() if self.column(columns[key]) is None)
        flagged: BoolArray = (np.where(np.isfinite(faults), faults, 0.0).astype(np.int64) & warning_bits(without)) != 0
        return flagged

    @cached_property
    def sample_period(self) -> float:
        """Return the time from sample to sample [s]."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 1.0

    @cached_property
    def settled(self) -> slice:
        """The part that axes are scaled for: after the first tenth, in which the estimator may still find its way."""
        return slice(len(self.time) // 10, None)

    @cached_property
    def changes(self) -> list[float]:
        """Times [s] at which the pilot or the trim jumped."""
        columns = [values for quantity in self.quantities if (values := self.truth(quantity)) is not None]
        trim = self.column("trim_true_rad")
        return jumps(self.time, columns + ([trim] if trim is not None else []))

    @cached_property
    def settings(self) -> dict[str, float]:
        """The estimator's settings: the run's own, and the firmware's defaults for what it does not tell."""
        defaults = {row.name: row.default for row in native.settings_table()}
        return defaults | (self.summary.estimator.settings if self.summary else {})

    @cached_property
    def lever(self) -> Lever:
        """The lever of the settings."""
        return Lever.from_settings(self.settings, self.summary.estimator.preload if self.summary else "trim")


def nis_averages(time: Array, nis: Array, outputs: Array, size: int, seconds: float) -> Averages:
    """Over stretches of `size` samples each, which are `seconds` [s] long."""
    used = np.where(np.isfinite(nis) & (nis > 0.0), outputs, 0.0)  # 0: nothing was compared in that sample
    whole = len(nis) // size * size
    freedom = used[:whole].reshape(-1, size).sum(axis=1)
    total = np.where(used > 0.0, nis, 0.0)[:whole].reshape(-1, size).sum(axis=1)
    return Averages(time[:whole].reshape(-1, size).mean(axis=1), total, freedom, seconds)
