"""The Kalman-type baselines in C against their reference in numpy, which is tested against textbook filters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_sil.study.baselines import BASELINES
from lever_sil.study.compare import cases, run_cases
from lever_sil.study.data import Batch
from numpy.typing import NDArray
from python.study.reference_filters import DualEkf, JointEkf, JointUkf, ParameterFilter, Recursion, follow

REFERENCES: dict[str, tuple[Callable[[Batch], Recursion], float]] = {
    "joint_ekf": (JointEkf, 1e-5),
    "dual_ekf": (DualEkf, 1e-5),
    "joint_ukf": (JointUkf, 1e-9),
    "algorithm1": (lambda batch: ParameterFilter(batch, 1), 1e-9),
    "algorithm1_ahead": (lambda batch: ParameterFilter(batch, 30), 1e-9),
}
"""What stands for each, and how near [standard deviations]: central differences magnify rounding by 1e5."""
CASES = (
    "lever_trim_dither_rough",
    "lever_fixed_base_quiet",
    "linear_physical_fixed_dither_rough",
    "linear_black_box_trim_base_rough",
)


@cache
def drawn(name: str) -> tuple[Batch, NDArray[np.int64]]:
    """Return a second of a case, and the samples after which it is compared."""
    case = cases.cases()[name]
    batch = case.batch(cases.Plan(seeds=2, duration=1.0))
    return batch, run_cases.samples(case, batch)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("baseline", REFERENCES)
def test_the_c_says_what_the_reference_says(name: str, baseline: str) -> None:
    batch, at = drawn(name)
    agree(baseline, batch, np.append(0, at))  # also before the first sample is followed


def agree(baseline: str, batch: Batch, at: NDArray[np.int64]) -> None:
    reference, near = REFERENCES[baseline]
    quick, slow = BASELINES[baseline].run(batch, at), follow(reference(batch), at)
    assert quick.covariance is not None
    assert slow.covariance is not None
    assert quick.nis is not None
    assert slow.nis is not None
    sigma = np.sqrt(np.diagonal(slow.covariance, axis1=2, axis2=3))
    assert np.abs((quick.w - slow.w) / sigma).max() < near
    assert np.abs((quick.covariance - slow.covariance) / (sigma[..., :, None] * sigma[..., None, :])).max() < near
    np.testing.assert_allclose(quick.nis, slow.nis, rtol=near, atol=near)


@pytest.mark.parametrize("baseline", ["joint_ekf", "joint_ukf"])
def test_a_missing_output_is_skipped_as_the_reference_does(baseline: str) -> None:
    """Theta of every sample, or now and then one of them or both."""
    batch, at = drawn("lever_trim_base_rough")
    half = replace(batch, missing=np.tile([True, False], (2, batch.samples, 1)))
    some = replace(batch, missing=np.random.default_rng(1).random((2, batch.samples, 2)) < 0.3)
    for one in (half, some):
        agree(baseline, one, at)
        assert not np.allclose(BASELINES[baseline].run(batch, at).w, BASELINES[baseline].run(one, at).w)


def test_a_model_that_the_c_has_not_is_refused() -> None:
    batch = replace(cases.cases()["step_up"].batch(cases.Plan(seeds=1, duration=1.0)), model=object())  # type: ignore[arg-type]
    with pytest.raises(LeverError, match="joint_ekf has no model object"):
        BASELINES["joint_ekf"].run(batch, np.array([1]))
