"""Whiteness against closed forms of white and first-order noise, and its band by Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.results import whiteness
from lever_cdkf.results.whiteness import AVERAGE, LAGS
from scipy import signal, stats

SIZE = 20  # samples at 1 kHz in an average
PERIOD = AVERAGE / SIZE


def coloured(seed: int, count: int, per_sample: float) -> np.ndarray:
    """First-order noise: correlation per_sample^k after k samples."""
    return np.asarray(signal.lfilter([1.0], [1.0, -per_sample], np.random.default_rng(seed).standard_normal(count)))


def test_white_noise_is_white() -> None:
    measured = whiteness.measure(np.random.default_rng(1).standard_normal(60_000), PERIOD)
    assert measured is not None
    assert measured.white
    assert measured.average_s == pytest.approx(AVERAGE)
    assert measured.band_95 == pytest.approx(stats.norm.ppf(0.975) / np.sqrt(3000), rel=1e-3)
    all_lags = stats.norm.ppf(0.5 + 0.5 * 0.95 ** (1.0 / whiteness.LAGS))
    assert measured.band_of_all == pytest.approx(all_lags / np.sqrt(3000), rel=1e-3)
    assert np.mean(np.abs(measured.autocorrelation) <= measured.band_95) >= 0.8


def test_first_order_noise_has_the_correlation_of_its_averages() -> None:
    """Cov of averages over n samples, k averages apart: sum over i, j of a^|n k + i - j| (n² times the variance)."""
    a = 0.98
    measured = whiteness.measure(coloured(2, 400_000, a), PERIOD)
    assert measured is not None
    index = np.arange(SIZE)
    expected = [np.sum(a ** np.abs(SIZE * k + index[:, None] - index)) for k in range(LAGS + 1)]
    assert measured.autocorrelation == pytest.approx(np.array(expected[1:]) / expected[0], abs=0.03)
    assert not measured.white
    assert measured.largest == max(measured.autocorrelation)
    assert measured.largest_after_s == pytest.approx(AVERAGE)


def test_a_little_colour_under_much_noise_is_found_by_averaging() -> None:
    """A motion of a quarter of the sensor's noise, alike for a tenth of a second: 6 % of a sample's variance."""
    rng = np.random.default_rng(3)
    motion = coloured(4, 60_000, np.exp(-PERIOD / 0.1))
    values = rng.standard_normal(60_000) + 0.25 * motion / np.std(motion)
    measured = whiteness.measure(values, PERIOD)
    assert measured is not None
    assert not measured.white
    assert np.corrcoef(values[1:], values[:-1])[0, 1] < 0.1  # where a look at single samples sees next to nothing


def test_what_is_too_short_or_holds_nothing_is_not_judged() -> None:
    assert whiteness.measure(np.random.default_rng(8).standard_normal(4 * LAGS * SIZE - 1), PERIOD) is None
    assert whiteness.measure(np.random.default_rng(8).standard_normal(4 * LAGS * SIZE), PERIOD) is not None
    assert whiteness.measure(np.zeros(60_000), PERIOD) is None
    assert whiteness.measure(np.full(60_000, np.nan), PERIOD) is None


def test_the_residual_is_measured_minus_estimated() -> None:
    trace = {"theta_dot_measured_rad_s": np.array([1.0, np.nan]), "theta_dot_estimate_rad_s": np.array([0.25, 0.5])}
    found = whiteness.residual(trace)
    assert found is not None
    np.testing.assert_array_equal(found, [0.75, np.nan])
    assert whiteness.residual({"theta_dot_estimate_rad_s": np.zeros(2)}) is None
