"""How columns are made fit for a page, against scipy and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.numeric.stretches import runs
from lever_cdkf.report import series
from lever_cdkf.report.bode import FREQUENCIES, slow_trim, transfer
from lever_cdkf.report.figure import Figure, axis, band, edges, time_axis
from lever_cdkf.report.printed import charts, values
from oracle import Lever
from scipy import signal

LEVER = Lever(0.45, 1.2, 0.5, 0.02, 0.5, 5.0, 0.35, 0.35, "trim")


@pytest.mark.parametrize(("count", "seconds"), [(20_000, 4.0), (20_001, 1.001), (700, 4.0)])
def test_welch_is_that_of_scipy(count: int, seconds: float) -> None:
    values = np.random.default_rng(1).standard_normal(count) + 3.0
    length = min(count, round(seconds / 1e-3))
    expected = signal.welch(values, 1e3, "hann", length, detrend="constant", noverlap=length - max(1, length // 2))
    frequency, power = series.welch(values, 1e-3, seconds)
    np.testing.assert_allclose(frequency, expected[0], atol=1e-9)
    np.testing.assert_allclose(power, expected[1], rtol=1e-9, atol=1e-15)


def test_welch_bridges_gaps() -> None:
    values = np.sin(2 * np.pi * 5.0 * np.arange(8000) * 1e-3)
    values[100:110] = np.nan
    frequency, power = series.welch(values, 1e-3)
    assert frequency[np.argmax(power)] == pytest.approx(5.0)
    assert not series.welch(np.full(100, np.nan), 1e-3)[1].any()


def test_response_is_that_of_scipy_and_peaks_near_the_natural_frequency() -> None:
    parameters, trim = np.array([[2.5, 3.0], [5.0, 8.0], [1500.0, 2500.0]]), np.array([0.35, 0.2])
    answer = transfer("lever", LEVER, parameters, trim).response(FREQUENCIES)
    for index, (m_p, c_p, k_p) in enumerate(parameters.T):
        cosine = np.cos(trim[index])
        inertia = 0.45**2 * (0.3 + m_p) + 0.02
        denominator = [inertia, c_p * (0.45 * cosine) ** 2 + 0.5, k_p * (0.45 * cosine) ** 2 + 5.0]
        _, expected = signal.freqs([-0.45 * (0.6 + m_p) * cosine], denominator, 2 * np.pi * FREQUENCIES)
        np.testing.assert_allclose(answer[index], expected, rtol=1e-12)
        natural = LEVER.dynamics(parameters[:, index : index + 1], trim[index])[0, 0]
        assert FREQUENCIES[np.argmax(np.abs(answer[index]))] == pytest.approx(natural, abs=0.15)


def test_slow_trim_is_the_rest_of_a_butterworth_high_pass_and_holds_over_gaps() -> None:
    """Of the sixth order, by scipy."""
    time = np.arange(4000) * 1e-3
    theta = np.full(4000, 1.0)
    theta[0] = 0.0
    theta[2000:3000] = np.nan
    trim = slow_trim(time, theta, 0.2)

    high_pass = signal.butter(6, 2.0 * np.pi * 0.2, "highpass", analog=True)

    def expected(t: float) -> float:
        return float(1.0 - signal.step(high_pass, T=np.linspace(0.0, t, 200))[1][-1])

    assert trim[999] == pytest.approx(expected(0.999), abs=2e-3)
    assert trim[1999] == pytest.approx(expected(1.999), abs=2e-3)
    assert trim[2999] == trim[1999]


def test_envelope_holds_least_and_greatest_of_each_stretch() -> None:
    time = np.arange(10_000) * 1e-3
    values = np.random.default_rng(2).standard_normal(10_000)
    values[5000:5010] = np.nan
    x, y = series.envelope(time, values, 1000)
    assert x.shape == y.shape == (2000,)
    rows = values.reshape(1000, 10)
    np.testing.assert_array_equal(y[0::2], rows.min(axis=1))  # NaN where all are, as only the gap has any
    np.testing.assert_array_equal(y[1::2], rows.max(axis=1))
    assert np.isnan(y[1000:1002]).all()
    assert np.nanmax(y) == np.nanmax(values)


def test_short_columns_are_drawn_as_they_are() -> None:
    time = np.arange(50.0)
    assert series.envelope(time, time)[1] is time
    np.testing.assert_array_equal(series.spread_indices(5, 100), np.arange(5))


def test_kept_indices_come_with_the_one_before() -> None:
    chosen = series.spread_indices(1000, 10, np.array([500, 0]))
    assert {0, 499, 500, 999} <= set(chosen.tolist())
    assert (np.diff(chosen) > 0).all()


def test_jumps_are_found_once_and_drift_is_none() -> None:
    time = np.arange(3000) * 1e-3
    stepping = np.where(time < 1.0, 1.0, 1.5)
    also = np.where(time < 1.001, 10.0, 20.0)
    drifting = 1.0 + time
    assert series.jumps(time, [stepping, also, drifting]) == [pytest.approx(1.0)]
    assert series.jumps(time, [drifting]) == []
    assert series.jumps(time[:1], [drifting[:1]]) == []


def test_runs_are_first_and_last_index() -> None:
    assert runs(np.array([True, True, False, True])) == [(0, 1), (3, 3)]
    assert runs(np.zeros(3, dtype=bool)) == []


def test_the_edges_of_a_band_are_within_what_can_be() -> None:
    value, sigma = np.array([1.0, 3.0, np.nan]), np.array([1.0, 1.0, 1.0])
    for limits, low, high in (({}, [-1.0, 1.0], [3.0, 5.0]), ({"least": 0.0, "most": 4.0}, [0.0, 1.0], [3.0, 4.0])):
        found = edges(value, sigma, **limits)
        assert [edge[:2].tolist() for edge in found] == [low, high]
        assert np.isnan([edge[2] for edge in found]).all()
    assert [edge[1] for edge in edges(value, sigma, sigmas=3.0)] == [0.0, 6.0]


def test_a_band_ends_where_an_edge_is_unknown() -> None:
    """On a page each stretch is a pair of traces, of which the legend shows one; in print each is an area."""
    time, low = np.arange(8.0), np.ones(8)
    low[3] = np.nan
    figure = Figure([axis("y")], time_axis(7.0))
    figure.add(*band(time, low, np.full(8, 2.0), "±2σ", "estimate-band"))
    assert [values(trace["x"]).tolist() for trace in figure.traces[::2]] == [[0, 1, 2], [4, 5, 6, 7]]
    assert [trace.get("showlegend", True) for trace in figure.traces] == [False, True, False, False]
    (axes,) = charts([("", figure.spec())], 3.0, "double").axes
    areas = [area.get_paths()[0].get_extents() for area in axes.collections]
    assert [(area.x0, area.x1) for area in areas] == [(0.0, 2.0), (4.0, 7.0)]
