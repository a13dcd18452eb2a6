"""Feedthrough of a trace: one frequency after the other, put side by side, however the trace is cut."""

from __future__ import annotations

import numpy as np
from lever_cdkf.results.feedthrough import FREQUENCIES, Feedthrough

COLUMNS = (
    *("time_s", "feedthrough_frequency_Hz", "feedthrough_real_rad_s2_m", "feedthrough_imaginary_rad_s2_m"),
    *("feedthrough_gain_sigma", "feedthrough_phase_sigma_rad"),
)


def test_each_frequency_is_as_last_sent_before_each_time() -> None:
    """A frequency each 20 ms from 0.1 s on, whose values say when they were sent; 6 Hz is not available until 2 s."""
    time = np.arange(0.0, 4.0, 1e-3)
    period = np.floor((time - 0.1) / 0.02)
    sent = 0.1 + 0.02 * period
    frequency = np.where(period < 0.0, np.nan, 2.0 + period % 7.0)
    gain_sigma = np.where((frequency == 6.0) & (sent < 2.0), np.nan, sent)
    values = (time, frequency, 0.001 * frequency, -0.002 * frequency, gain_sigma, 2.0 * sent)
    trace = dict(zip(COLUMNS, values, strict=True))
    asked = np.array([0.05, 0.15, 1.0, 2.5, 3.9])
    for pieces in (1, 37):
        kept = Feedthrough()
        for rows in np.array_split(np.arange(len(time)), pieces):
            kept.add({name: column[rows] for name, column in trace.items()})
        found = kept.at(asked)
        assert np.isnan(found["response"][0]).all()
        np.testing.assert_allclose(found["response"][2:], np.tile((0.001 - 0.002j) * FREQUENCIES, (3, 1)))
        age = asked[2:, np.newaxis] - 0.5 * found["phase_sigma"][2:]
        assert np.all((age > -1e-9) & (age < 0.65))  # half a second and a turn of seven
        assert np.isnan(found["gain_sigma"][2, 4])
        assert np.isfinite(found["gain_sigma"][3:]).all()


def test_a_trace_without_it_leaves_nothing() -> None:
    kept = Feedthrough()
    kept.add({"time_s": np.arange(3.0)})
    assert np.isnan(kept.at(np.array([1.0]))["gain_sigma"]).all()
