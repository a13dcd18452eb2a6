"""Estimates that a recording already holds, of an estimator that ran when it was made, against those of the replay."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..firmware.quantities import DYNAMICS, quantities, recorded_name
from ..results import summary
from ..results.summary import Difference
from ..results.trace import ESTIMATED, Trace


@dataclass(frozen=True)
class _Signal:
    name: str
    unit: str
    column: str
    sigma: str | None


def signals(model: str) -> list[_Signal]:
    """Return what is compared: states, NIS, and each quantity with its standard deviation."""
    units = {"theta": "rad", "theta_dot": "rad/s", "nis": "1"}
    compared = [_Signal(field, units[field], column, None) for column, _, field in ESTIMATED]
    for each in quantities(model):
        estimate, sigma = each.column("estimate"), each.column("sigma")
        compared.append(_Signal(each.key, each.unit, estimate, sigma))
        compared.append(_Signal(f"{each.key}_sigma", each.unit, sigma, None))
    return compared


class _Sums:
    """Of one signal."""

    def __init__(self, signal: _Signal) -> None:
        self.signal = signal
        self.difference = Difference(signal.unit)
        self._sum = self._squares = self._in_sigma = 0.0
        self._with_sigma = 0

    def add(self, trace: Trace) -> None:
        difference = trace[self.signal.column] - trace[recorded_name(self.signal.column)]
        finite = np.isfinite(difference)
        count = int(finite.sum())
        if not count:
            return
        result, values = self.difference, difference[finite]
        result.samples += count
        result.identical_samples += int(np.sum(values == 0.0))
        self._sum += float(np.sum(values))
        self._squares += float(values @ values)
        farthest = int(np.argmax(np.abs(values)))
        if result.largest is None or abs(values[farthest]) > abs(result.largest):
            result.largest = float(values[farthest])
            result.largest_at_s = float(trace["time_s"][finite][farthest])
        if self.signal.sigma is not None:
            sigma = trace[self.signal.sigma][finite]
            with_sigma = sigma > 0.0
            self._with_sigma += int(with_sigma.sum())
            self._in_sigma += float(np.sum(np.square(values[with_sigma] / sigma[with_sigma])))

    def finished(self) -> Difference:
        result = self.difference
        if result.samples:
            result.bias, result.rms = self._sum / result.samples, math.sqrt(self._squares / result.samples)
        if self._with_sigma:
            result.rms_in_sigma = math.sqrt(self._in_sigma / self._with_sigma)
        return result


class Comparison:
    """Signal by signal."""

    def __init__(self, model: str) -> None:
        self._sums = [_Sums(signal) for signal in signals(model)]
        self._names = {quantity.key: quantity.name for quantity in DYNAMICS}

    def add(self, trace: Trace) -> None:
        """Further samples."""
        for each in self._sums:
            each.add(trace)

    def summary(self) -> summary.Comparison | None:
        """None where the recording holds no estimates."""
        differences = {each.signal.name: each.finished() for each in self._sums}
        compared = [each for each in differences.values() if each.samples]
        if not compared:
            return None
        identical = all(each.identical_samples == each.samples for each in compared)
        return summary.Comparison(identical, differences, self._in_words(differences, identical))

    def _in_words(self, differences: dict[str, Difference], identical: bool) -> str:
        if identical:
            return "The estimates that were recorded with the log are reproduced bit for bit."
        by_sigma = {name: each for name, each in differences.items() if each.rms_in_sigma is not None}
        if not by_sigma:
            return "The log holds estimates too, but none of this model's parameters: only the states can be compared."
        worst = max(by_sigma, key=lambda name: by_sigma[name].rms_in_sigma or 0.0)
        difference = by_sigma[worst]
        unit = "" if difference.unit == "1" else f" {difference.unit}"
        return (
            f"Against the estimates that were recorded with the log, {self._names.get(worst, worst)} differs most: rms "
            f"{difference.rms_in_sigma:.2g} σ ({difference.rms:.3g}{unit}), at most "
            f"{abs(difference.largest or 0.0):.3g}{unit} at {difference.largest_at_s:.1f} s."
        )
