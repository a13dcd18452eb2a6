"""Measured coherence against scipy's, in pieces and with gaps."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.results.coherence import Coherence

signal = pytest.importorskip("scipy.signal")


def test_in_pieces_it_is_that_of_scipy() -> None:
    rng = np.random.default_rng(1)
    x = rng.standard_normal(20_000)
    y = np.convolve(x, [1.0, 0.5, 0.2])[: len(x)] + rng.standard_normal(len(x)) + 3.0
    in_pieces = Coherence(1e-3, 2.0)
    for piece in np.array_split(np.arange(len(x)), 13):
        in_pieces.add(x[piece], y[piece])
    frequency, coherence = in_pieces.spectrum()
    expected_frequency, expected = signal.coherence(x, y, 1000.0, nperseg=2000)
    np.testing.assert_allclose(frequency, expected_frequency)
    np.testing.assert_allclose(coherence, expected, rtol=1e-9)
    assert in_pieces.windows == 19


def test_gaps_lower_it_and_nothing_is_made_up() -> None:
    rng = np.random.default_rng(3)
    x = rng.standard_normal(10_000)
    y = np.where(rng.random(len(x)) < 0.2, np.nan, x)
    in_pieces, silent, short = Coherence(1e-3, 1.0), Coherence(1e-3, 1.0), Coherence(1e-3, 1.0)
    in_pieces.add(x, y)
    assert 0.7 < np.median(in_pieces.spectrum()[1]) < 0.95
    silent.add(x, np.full(len(x), np.nan))
    short.add(x[:1400], x[:1400])
    assert np.isnan(silent.spectrum()[1]).all()
    assert np.isnan(short.spectrum()[1]).all()
    assert short.chance() == 1.0
