"""The Kalman-type baselines in C against the classes in Python, of which each is tested against a textbook filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from lever_sil.study.baselines import BASELINES
from lever_sil.study.baselines.algorithm1 import ParameterFilter
from lever_sil.study.baselines.dual_ekf import DualEkf
from lever_sil.study.baselines.joint_ekf import JointEkf
from lever_sil.study.baselines.joint_ukf import JointUkf
from lever_sil.study.baselines.recursion import Recursion, follow
from lever_sil.study.compare import cases, run_cases
from lever_sil.study.data import Batch

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


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("baseline", REFERENCES)
def test_the_c_says_what_the_reference_says(name: str, baseline: str) -> None:
    case = cases.cases()[name]
    batch = case.batch(cases.Plan(seeds=2, duration=2.0))
    at = np.append(0, run_cases.samples(case, batch))  # also before the first sample is followed
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


def test_a_missing_output_is_left_to_the_reference() -> None:
    case = cases.cases()["lever_trim_base_rough"]
    batch = case.batch(cases.Plan(seeds=2, duration=1.0))
    at = run_cases.samples(case, batch)
    half = replace(batch, missing=np.tile([True, False], (2, batch.samples, 1)))
    expected = follow(JointEkf(half), at)
    assert np.array_equal(BASELINES["joint_ekf"].run(half, at).w, expected.w)
    assert not np.allclose(BASELINES["joint_ekf"].run(batch, at).w, expected.w)
