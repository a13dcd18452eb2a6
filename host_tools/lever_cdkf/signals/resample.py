"""Signals with rates and clocks of their own as the firmware's samples: one clock, and NaN where a value is missing.

One signal is the clock: each of its values makes a sample. It is the slowest of the model's inputs z_ddot and tau_m:
the firmware learns only where these are known, and can do without the lever's in between. Where angle or rate come
about as often (a third more or less), it is one of them: what is measured is then not interpolated.
Any other signal is, against it,
- paired, where its values come at a constant offset from the clock's: one sender measured both, and sent one frame
  after the other;
- interpolated, where its rate is about the clock's or above, but its clock another;
- left missing in between, where it is slower: each value belongs to the sample next to it, and is not repeated.
Nothing is interpolated over a gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import LeverError
from ..firmware.config import Config, setting
from ..numeric.arrays import FloatArray, IntArray
from .recorded import Signal, ordered

_ALIKE = 1.33  # periods that differ by less are of one rate
_SLOWER = 1.5  # periods of the clock: a signal with longer ones is missing in between
_GAP = 2.5  # periods of a signal: over longer steps nothing is interpolated
_PAIRED_OFFSET = 0.35  # of a period
_PAIRED_SPREAD = 0.1


@dataclass(frozen=True)
class Samples:
    """What the firmware takes."""

    time: FloatArray
    """Of the clock [s]."""
    time_us: IntArray
    columns: dict[str, FloatArray]
    """By input; NaN is missing."""
    period: float
    """Usual time between two samples [s], to four digits."""
    clock: str
    how: dict[str, str]
    """By input: clock, paired, interpolated or slower."""
    disordered: int
    """Values left out since they were not later than those before them."""

    def arrays(self) -> dict[str, FloatArray | IntArray]:
        """Return what run_samples() takes."""
        return {"time_us": self.time_us, **self.columns}


def sample(signals: Mapping[str, Signal], clock: str | None = None) -> Samples:
    """Return samples of signals in the firmware's units, by input. Raise LeverError."""
    cleaned = {key: ordered(signal) for key, signal in signals.items()}
    clean = {key: signal for key, (signal, _) in cleaned.items()}
    clock = clock or _clock(clean)
    if clock not in clean:
        raise LeverError(f"--clock {clock}: it is not mapped; {', '.join(clean)} are")
    time, period = clean[clock].time, clean[clock].period
    check_period(period, clock, clean[clock].name)
    columns, how = {}, {}
    for key, signal in clean.items():
        columns[key], how[key] = (signal.values, "clock") if key == clock else _at(time, period, signal)
        if not np.isfinite(columns[key]).any():
            raise LeverError(f"{key} = {signal.name}: no value of it is at the time of {clock} = {clean[clock].name}")
    time_us = np.rint((time - min(float(time[0]), 0.0)) * 1e6).astype(np.int64)
    period = float(f"{period:.4g}")
    return Samples(time, time_us, columns, period, clock, how, sum(count for _, count in cleaned.values()))


def check_period(period: float, key: str, name: str) -> None:
    """Raise LeverError where the firmware takes no samples at this distance [s]."""
    row = setting("sample_period")
    if not row.least * 0.999 <= period <= row.greatest * 1.001:
        rate = f"every {1e3 * period:.4g} ms ({1.0 / period:.4g} Hz)" if np.isfinite(period) else "only once"
        raise LeverError(
            f"{key} = {name} comes {rate}; the firmware takes samples from {1.0 / row.greatest:g} to "
            f"{1.0 / row.least:g} Hz: take a faster signal, or record it faster"
        )


def at_period(config: Config, period: float) -> Config:
    """`config` with the period of the samples [s], unless it sets one that is not the default. Raises LeverError."""
    settings = config.settings
    if settings["sample_period"] == setting("sample_period").default:
        settings["sample_period"] = period
    return Config(**config.choices, settings=settings)


def _clock(signals: Mapping[str, Signal]) -> str:
    """Return which of the signals makes the samples."""
    slowest = setting("sample_period").greatest * 1.001
    inputs = [key for key in ("z_ddot", "tau_m") if key in signals]
    inputs = [key for key in inputs if signals[key].period <= slowest] or inputs[:1]
    lever = [key for key in ("theta", "theta_dot") if key in signals]
    clock = max(inputs or lever, key=lambda key: signals[key].period)
    alike = [key for key in lever if 1.0 / _ALIKE < signals[key].period / signals[clock].period < _ALIKE]
    return alike[0] if alike else clock


def _at(time: FloatArray, period: float, signal: Signal) -> tuple[FloatArray, str]:
    """Return the values of a signal at the samples' times, and how they came there."""
    if not len(signal.time):
        return np.full(len(time), np.nan), "slower"
    if signal.period > _SLOWER * period:
        return _nearest(time, signal, 0.5 * period), "slower"
    offset = signal.time[_next_to(time, signal.time)] - time
    near = np.abs(offset) < period
    if near.any():
        low, middle, high = np.percentile(offset[near], [5.0, 50.0, 95.0])
        if abs(middle) < _PAIRED_OFFSET * period and high - low < _PAIRED_SPREAD * period:
            return _nearest(time + middle, signal, 0.5 * period), "paired"
    return _interpolated(time, signal), "interpolated"


def offset_between(time: FloatArray, others: FloatArray) -> float:
    """By how much times are later than the ones next to them, usually [s]."""
    return float(np.median(others[_next_to(time, others)] - time))


def _next_to(time: FloatArray, others: FloatArray) -> IntArray:
    """For each time the index of the nearest of `others`, which rise."""
    after = np.clip(np.searchsorted(others, time), 1, max(len(others) - 1, 1))
    if len(others) == 1:
        return np.zeros(len(time), np.int64)
    return np.where(time - others[after - 1] <= others[after] - time, after - 1, after).astype(np.int64)


def _nearest(time: FloatArray, signal: Signal, most: float) -> FloatArray:
    """Return each value at the time next to it, at most once and at most `most` [s] away; elsewhere NaN."""
    taken = np.full(len(time), np.nan)
    place = _next_to(signal.time, time)
    distance = np.abs(time[place] - signal.time)
    for_it = np.lexsort((distance, place))  # of several values for one time the nearest
    first = np.diff(place[for_it], prepend=-1) != 0
    chosen = for_it[first & (distance[for_it] <= most * (1.0 + 1e-6))]
    taken[place[chosen]] = signal.values[chosen]
    return taken


def _interpolated(time: FloatArray, signal: Signal) -> FloatArray:
    valid = np.isfinite(signal.values)
    at, values = signal.time[valid], signal.values[valid]
    if len(at) < 2:
        return np.full(len(time), np.nan)
    after = np.clip(np.searchsorted(at, time), 1, len(at) - 1)
    step = at[after] - at[after - 1]
    inside = (time >= at[0]) & (time <= at[-1]) & (step <= _GAP * signal.period)
    return np.where(inside, np.interp(time, at, values), np.nan)
