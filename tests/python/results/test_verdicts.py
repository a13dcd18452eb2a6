"""What verdicts stand on: the figures of innovations against SciPy, and each threshold from both of its sides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lever_cdkf.results import nis, whiteness
from lever_cdkf.results.nis import Innovations, Nis
from scipy import stats


def test_figures_of_innovations_are_those_of_chi_square() -> None:
    """Samples with one output and with two, in pieces; without an output or an answer they count for nothing."""
    rng = np.random.default_rng(1)
    theta, theta_dot = (np.where(rng.random(4000) < share, 0.1, np.nan) for share in (0.6, 0.8))
    outputs = nis.freedom(theta, theta_dot)
    assert outputs.tolist() == [
        int(a) + int(b) for a, b in zip(np.isfinite(theta), np.isfinite(theta_dot), strict=True)
    ]
    values = np.where(rng.random(4000) < 0.05, np.nan, rng.chisquare(np.maximum(outputs, 1)))
    innovations = Innovations()
    assert innovations.figures() == Nis()
    for piece in np.array_split(np.arange(4000), 3):
        innovations.add(values[piece], outputs[piece])
    used = (outputs > 0) & np.isfinite(values)
    nis_figures, expected = innovations.figures(), outputs[used].mean()
    assert nis_figures.mean == pytest.approx(values[used].mean())
    assert nis_figures.expected == pytest.approx(expected)
    half = stats.norm.ppf(0.975) * math.sqrt(2.0 * expected / used.sum())  # the variance of chi-square is 2 n
    assert nis_figures.mean_band_95 == pytest.approx([expected - half, expected + half])
    inside = values[used] <= stats.chi2.ppf(0.95, outputs[used])
    assert nis_figures.inside_95_percent == pytest.approx(inside.mean())


@pytest.mark.parametrize(
    ("ratio", "size"), [(0.89, "smaller than"), (0.91, "as large as"), (1.09, "as"), (1.11, "larger than")]
)
def test_innovations_are_called_large_or_small_beyond_a_tenth(ratio: float, size: str) -> None:
    assert nis.verdict(Nis(mean=2.0 * ratio, expected=2.0)).startswith(f"Innovations are {size}")
    assert nis.verdict(Nis()) == ""


@pytest.mark.parametrize(("correlation", "white"), [(0.19, True), (0.21, False), (-0.19, True), (-0.21, False)])
def test_a_fifth_of_correlation_makes_a_long_residual_coloured(correlation: float, white: bool) -> None:
    """Moving averages of first order, e_k + b e_{k-1}, have the correlation b / (1 + b²)."""
    b = (1.0 - math.sqrt(1.0 - 4.0 * correlation**2)) / (2.0 * correlation)
    noise = np.random.default_rng(2).standard_normal(400_000)
    measured = whiteness.of_averages(noise[1:] + b * noise[:-1], 0.02)
    assert measured is not None
    assert measured.autocorrelation[0] == pytest.approx(correlation, abs=0.005)
    assert measured.white is white
    text = whiteness.verdict(measured)
    assert f"{measured.largest:.2f} after 20 ms" in text
    assert ("slightly correlated" in text) is white
    assert "white" not in text
    assert ("are coloured" in text) is not white
    assert whiteness.verdict(None) == ""


@pytest.mark.parametrize(
    ("share", "white", "said"),
    [
        (0.99, True, "Residuals of the rate are white up to a lag of 0.5 s (chance alone: within ±{band:.2f}). "),
        (-0.99, True, "Residuals of the rate are white up to a lag of 0.5 s (chance alone: within ±{band:.2f}). "),
        (
            1.01,
            True,
            "Residuals of the rate are slightly correlated ({largest:.2f} after 140 ms; chance alone: within ",
        ),
        (
            -1.01,
            True,
            "Residuals of the rate are slightly correlated ({largest:.2f} after 140 ms; chance alone: within ",
        ),
        (
            2.0,
            False,
            "Residuals of the rate are coloured (correlation {largest:.2f} after 140 ms; chance alone: within ",
        ),
    ],
)
def test_residuals_in_words(share: float, white: bool, said: str) -> None:
    measured = whiteness.Whiteness(0.02, [0.0] * 25, 0.04, 0.0, 0.14, white)
    band = measured.band_of_all
    assert band == pytest.approx(0.04 * stats.norm.ppf(0.5 + 0.5 * 0.95 ** (1 / 25)) / stats.norm.ppf(0.975))
    largest = share * band
    text = whiteness.verdict(replace(measured, largest=largest))
    assert text.startswith(said.format(band=band, largest=largest))
    assert text.endswith(whiteness.CANNOT_SEE) is white
    assert ("below the 0.2 from which on the model counts as wrong" in text) is (white and abs(share) > 1.0)


@pytest.mark.parametrize(("ratio", "size"), [(0.9, "as large as"), (1.1, "as large as")])
def test_innovations_in_words(ratio: float, size: str) -> None:
    said = nis.verdict(Nis(mean=2.0 * ratio, expected=2.0))
    assert said == f"Innovations are {size} the filter expects (mean NIS {2.0 * ratio:.2f}, expected 2.00)."


def test_an_average_needs_half_of_its_values() -> None:
    values = np.array([1.0, 3.0, np.nan, np.nan, 5.0, np.nan, np.nan, np.nan, 7.0])
    np.testing.assert_array_equal(whiteness.averages(values, 4), [2.0, np.nan])
