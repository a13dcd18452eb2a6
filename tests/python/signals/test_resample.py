"""Signals of several rates and clocks as samples: nothing is invented, and what is known is where it was measured."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.signals.recorded import Signal
from lever_cdkf.signals.resample import sample
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def signal(time: FloatArray, name: str = "x") -> Signal:
    """Return a sine of 3 Hz, measured at these times."""
    return Signal(name, time, wave(time))


def wave(time: FloatArray) -> FloatArray:
    return np.sin(6.0 * np.pi * time)


def clock(rate: float, offset: float = 0.0, seconds: float = 4.0) -> FloatArray:
    return offset + np.arange(round(seconds * rate)) / rate


def test_a_slow_one_is_missing_in_between_and_nowhere_else() -> None:
    sampled = sample({"theta": signal(clock(100.0)), "z_ddot": signal(clock(500.0))})
    assert (sampled.clock, sampled.how["theta"], sampled.period) == ("z_ddot", "slower", 2e-3)
    there = np.isfinite(sampled.columns["theta"])
    np.testing.assert_array_equal(np.flatnonzero(there), np.arange(0, 2000, 5))
    np.testing.assert_array_equal(sampled.columns["theta"][there], wave(clock(100.0)))


def test_what_the_model_is_driven_by_makes_the_samples() -> None:
    fast, slow, slower = clock(1000.0), clock(500.0), clock(100.0)
    assert sample({"theta": signal(fast), "z_ddot": signal(slow)}).clock == "z_ddot"
    assert sample({"theta": signal(fast), "z_ddot": signal(fast)}).clock == "theta"
    with_torque = {"theta": signal(fast), "z_ddot": signal(slow), "tau_m": signal(slower)}
    assert sample(with_torque).clock == "tau_m"
    assert sample(with_torque, "theta").how == {"theta": "clock", "z_ddot": "slower", "tau_m": "slower"}
    assert sample({**with_torque, "tau_m": signal(clock(10.0))}).clock == "z_ddot"


def test_one_burst_is_one_sample() -> None:
    """Frames that follow each other at once hold values of one moment, whatever their stamps."""
    time = clock(500.0)
    jitter = np.random.default_rng(1).normal(0.0, 2e-5, len(time))
    sampled = sample({"theta": signal(time), "z_ddot": Signal("z", time + 3e-4 + jitter, wave(time))})
    assert sampled.how["z_ddot"] == "paired"
    np.testing.assert_array_equal(sampled.columns["z_ddot"], wave(time))


@pytest.mark.parametrize("drift", [0.0, 1e-3, -2e-3])
def test_another_clock_is_interpolated(drift: float) -> None:
    sampled = sample({"theta": signal(clock(500.0)), "z_ddot": signal(clock(500.0 * (1.0 + drift), 0.0009))})
    assert sampled.how["z_ddot"] == "interpolated"
    there = np.isfinite(sampled.columns["z_ddot"])
    assert there.mean() > 0.99
    np.testing.assert_allclose(sampled.columns["z_ddot"][there], wave(clock(500.0))[there], atol=2e-4)


@pytest.mark.parametrize("offset", [0.0, 0.0009])
def test_nothing_is_invented_in_a_gap(offset: float) -> None:
    time = clock(500.0, offset)
    gap = (time > 1.0) & (time < 1.2)
    sampled = sample({"theta": signal(clock(500.0)), "z_ddot": signal(time[~gap])})
    missing = clock(500.0)[np.isnan(sampled.columns["z_ddot"])]
    assert 1.0 <= missing[missing > 0.1].min() <= 1.003
    assert 1.197 <= missing.max() <= 1.2
    assert len(missing[missing > 0.1]) == pytest.approx(100, abs=1)


def test_a_lost_frame_is_a_missing_value_and_a_gap_of_the_clock_one_of_time() -> None:
    time = clock(500.0)
    lost = np.delete(time, [700, 701, 900])
    sampled = sample({"theta": signal(time), "z_ddot": signal(lost)})
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(sampled.columns["z_ddot"])), [700, 701, 900])
    sampled = sample({"theta": signal(lost), "z_ddot": signal(time)}, "theta")
    assert np.diff(sampled.time_us).max() == 6000
    assert np.isfinite(sampled.columns["z_ddot"]).all()


def test_what_goes_back_in_time_is_left_out() -> None:
    time = clock(500.0)
    odd = np.concatenate((time[:1000], time[990:1000], time[1000:]))
    sampled = sample({"theta": signal(odd), "z_ddot": signal(time)})
    assert (len(sampled.time_us), sampled.disordered) == (2000, 10)
    assert (np.diff(sampled.time_us) == 2000).all()


@pytest.mark.parametrize(("rate", "said"), [(20.0, "every 50 ms"), (20000.0, "every 0.05 ms")])
def test_rates_that_the_firmware_does_not_take(rate: float, said: str) -> None:
    with pytest.raises(LeverError, match=said):
        sample({"theta": signal(clock(rate)), "z_ddot": signal(clock(rate))})


def test_signals_that_are_not_of_one_time() -> None:
    with pytest.raises(LeverError, match="no value of it is at the time of"):
        sample({"theta": signal(clock(500.0)), "z_ddot": signal(clock(500.0, 1000.0))})


@pytest.mark.parametrize(
    ("offset", "spread", "how"),
    [
        (0.34, 0.0, "paired"),
        (0.36, 0.0, "interpolated"),
        (-0.34, 0.0, "paired"),
        (0.2, 0.09, "paired"),
        (0.2, 0.13, "interpolated"),
    ],
)
def test_a_pair_is_a_third_of_a_period_apart_at_most_and_steady(offset: float, spread: float, how: str) -> None:
    time = clock(500.0)
    jitter = spread * (np.arange(len(time)) % 2)
    sampled = sample({"theta": signal(time), "z_ddot": Signal("z", time + 2e-3 * (offset + jitter), wave(time))})
    assert sampled.how["z_ddot"] == how


@pytest.mark.parametrize(("rate", "how"), [(500.0 / 1.4, "interpolated"), (500.0 / 1.6, "slower")])
def test_what_is_slower_by_half_is_missing_in_between(rate: float, how: str) -> None:
    assert sample({"theta": signal(clock(rate)), "z_ddot": signal(clock(500.0))}, "z_ddot").how["theta"] == how


@pytest.mark.parametrize(("lost", "missing"), [(1, 0), (2, 2)])
def test_nothing_is_interpolated_over_more_than_two_and_a_half_periods(lost: int, missing: int) -> None:
    time = clock(500.0, 0.0009)
    sampled = sample({"theta": signal(clock(500.0)), "z_ddot": signal(np.delete(time, range(700, 700 + lost)))})
    inside = np.isnan(sampled.columns["z_ddot"])[600:800].sum()
    assert inside == (0 if not missing else lost + 1)


@pytest.mark.parametrize(("rate", "clock_of"), [(1000.0 / 1.3, "theta"), (1000.0 / 1.36, "z_ddot")])
def test_a_lever_signal_of_about_the_rate_is_the_clock(rate: float, clock_of: str) -> None:
    assert sample({"theta": signal(clock(1000.0)), "z_ddot": signal(clock(rate))}).clock == clock_of
