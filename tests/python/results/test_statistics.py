"""Quantiles against SciPy."""

from __future__ import annotations

import pytest
from lever_cdkf.numeric.quantiles import chi_square_band, chi_square_quantile
from scipy import stats

PROBABILITIES = (0.001, 0.025, 0.5, 0.95, 0.975, 0.999)


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 7, 30, 251, 500, 5001])
def test_chi_square(freedom: int) -> None:
    for probability in PROBABILITIES:
        expected = stats.chi2.ppf(probability, freedom)
        assert chi_square_quantile(probability, freedom) == pytest.approx(expected, rel=1e-10)
    assert chi_square_band(freedom) == pytest.approx(stats.chi2.ppf((0.025, 0.975), freedom), rel=1e-10)
