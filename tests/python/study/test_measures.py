"""The measures of all tables, against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.firmware.estimator import DO_NOT_TRUST
from lever_cdkf.firmware.library import lib
from lever_sil import measures


def test_rms_and_coverage() -> None:
    errors = np.array([[3.0, -4.0, 0.0], [1.0, 2.0, 2.0]])
    np.testing.assert_allclose(measures.rms(errors, axis=1), [5.0 / np.sqrt(3.0), np.sqrt(3.0)])
    assert measures.rms(np.array([3.0 + 4.0j])) == 5.0
    sigma = np.array([[2.0, 1.0, 0.0], [0.5, 0.5, 1.0]])
    np.testing.assert_allclose(measures.covered(errors, sigma, axis=1), [2.0 / 3.0, 2.0 / 3.0])
    assert measures.covered(errors, sigma) == pytest.approx(2.0 / 3.0)


def test_what_is_flagged() -> None:
    change, base = lib.LEVER_FAULT_CHANGE, lib.LEVER_FAULT_BASE
    faults = np.array([0, change, base, base | change], dtype=np.uint32)
    assert measures.is_flagged(faults, DO_NOT_TRUST).tolist() == [False, False, True, True]
    assert measures.is_flagged(faults, change).tolist() == [False, True, False, True]
    assert DO_NOT_TRUST & base


def test_rows_of_what_is_true() -> None:
    true = np.array([True, False, True, True, False])
    assert measures.longest(true) == 2
    assert measures.longest(np.array([False])) == 0
    assert measures.first_without(true, 1) == 1.0
    assert measures.first_without(np.stack([true, ~true]), 2).tolist() == [np.inf, 2.0]


def test_covariances_of_what_an_estimate_states() -> None:
    found = measures.covariance_of(np.array([1.0, 2.0, 4.0]), np.array([0.5, 0.25, -0.5]))
    np.testing.assert_allclose(found, [[1.0, 1.0, 1.0], [1.0, 4.0, -4.0], [1.0, -4.0, 16.0]])
    errors = np.array([1.0, -2.0, 4.0])
    expected = errors @ np.linalg.inv(found) @ errors
    assert measures.normalised_squares(errors, found) == pytest.approx(expected)


def test_a_filter_that_states_a_singular_covariance_is_infinitely_wrong() -> None:
    covariance = np.stack([np.eye(2), np.ones((2, 2))])[None]
    np.testing.assert_array_equal(measures.normalised_squares(np.ones((1, 2, 2)), covariance), [[2.0, np.inf]])


ELAPSED = np.arange(-2.0, 8.0)  # the change is at index 2


@pytest.mark.parametrize(
    ("relative", "settled"),
    [
        ([0, 0, 0.30, 0.20, 0.05, 0.04, 0.03, 0.02, 0.01, 0.01], 2.0),  # the limit itself is inside
        ([0, 0, 0.30, -0.04, 0.04, 0.06, 0.03, 0.02, 0.01, 0.01], 4.0),  # out once more
        ([0, 0, 0.30, -0.20, -0.06, -0.05, 0, 0, 0, 0], 3.0),  # from below
        ([9, 9, 0.01, 0.01, 0.02, 0.01, 0.00, 0.01, 0.01, 0.01], 0.0),  # at once; what was before does not count
        ([0, 0, 0.30, 0.04, 0.04, 0.04, 0.04, 0.04, 0.04, 0.06], np.nan),  # out at the end
        ([0, 0, 0.30, 0.04, 0.04, np.nan, 0.04, 0.04, 0.04, 0.01], 4.0),  # a time without an estimate
        ([0, 0, 0.30, 0.04, 0.04, 0.04, 0.04, np.nan, np.nan, np.nan], np.nan),  # broken down
    ],
)
def test_settling_time(relative: list[float], settled: float) -> None:
    both = np.array([relative, np.full(10, 0.5)])
    np.testing.assert_array_equal(measures.settling_times(both, ELAPSED), [settled, np.nan])


def test_nothing_settles_after_the_end() -> None:
    assert np.isnan(measures.settling_times(np.zeros((2, 3)), np.array([-3.0, -2.0, -1.0]))).all()
