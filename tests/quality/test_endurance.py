"""Single precision does not stall: over an hour of flight the estimator stays where double precision takes it.

The program of endurance/ is the firmware's core twice, once as shipped and once with every float a double and libm's
functions for its own. Both see the same samples: an arm that drifts by a factor of two, and an arm that is hardly
shaken, so that what a sample adds to the covariance is less than single precision holds.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.host_tools.config import setting
from lever_cdkf.host_tools.native import enum_names
from quality import tools

SECONDS = 3600
LINES_A_SECOND = 10
WITHIN = 0.05
"""Greatest difference of the two, in standard deviations; and of their standard deviations, relatively."""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("endurance")
    tools.assert_silent(["cmake", "-S", Path(__file__).with_name("endurance"), "-B", folder])
    tools.assert_silent(["cmake", "--build", folder, "--target", "single", "double", "--parallel", "2"])
    return folder


@cache
def flown(program: Path, scene: str, estimator: int) -> np.ndarray:
    """Columns: time [s], then value and standard deviation of each parameter."""
    result = tools.run([program, scene, str(estimator), str(SECONDS)])
    assert result.returncode == 0, "the belief broke its invariant"
    return np.array([line.split() for line in result.stdout.splitlines()], dtype=np.float64)


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.parametrize("scene", ["drift", "calm"])
@pytest.mark.parametrize(("estimator", "name"), enum_names("lever_estimator").items())
def test_single_precision_goes_where_double_goes(programs: Path, scene: str, estimator: int, name: str) -> None:
    with ThreadPoolExecutor() as pool:
        both = pool.map(lambda precision: flown(programs / precision, scene, estimator), ("single", "double"))
    single, double = both
    assert len(single) == len(double) == SECONDS * LINES_A_SECOND
    value, sigma = slice(1, None, 2), slice(2, None, 2)
    assert (np.abs(single[:, value] - double[:, value]) / double[:, sigma]).max() <= WITHIN
    assert np.abs(single[:, sigma] / double[:, sigma] - 1.0).max() <= WITHIN


@pytest.mark.requires("cc|gcc|clang")
def test_the_two_scenes_are_what_they_claim(programs: Path) -> None:
    """Drift: followed, and surely. Calm: little is learnt, and uncertainty does not wind up."""
    drift, calm = (flown(programs / "single", scene, 0) for scene in ("drift", "calm"))
    drift_unsure, calm_unsure = (np.median(run[:, 6] / run[:, 5]) for run in (drift, calm))
    assert drift[600:, 5].max() / drift[600:, 5].min() > 1.8
    assert drift_unsure < 0.06
    assert calm_unsure > 2.0 * drift_unsure
    assert (calm[:, 2] / calm[:, 1]).max() <= setting("m_p_sigma").default * (1.0 + 1e-5)
