"""Single precision does not stall: over an hour of flight the estimator stays where double precision takes it.

The program of endurance/ is the firmware's core twice, once as the build has it and once with every float a double and
libm's functions for its own. Both see the same samples: an arm that drifts by a factor of two, and an arm that is
hardly shaken, so that what a sample adds to the covariance is less than single precision holds.

Change detection and noise estimation compare with thresholds. A value that is on its threshold may fall on either side
of it by rounding alone, after which the two differ for a while. So the filter by itself is held to a tighter bound,
over the calm hour, and the filter as shipped to a wider one for all but a hundredth of the hour that drifts.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.native import enum_names
from quality import tools

SECONDS = 3600
LINES_A_SECOND = 10

FOLDER = Path(__file__).with_name("endurance")
FACADE = [
    tools.FIRMWARE / "app" / f"{name}.c"
    for name in ("lever", "instance", "bounce", "link", "link_out", "recorder", "state")
]
"""Not built in double precision: the instance of the façade, and its state in bytes, have room for floats only."""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory, build_dir: Path) -> Path:
    """Return the folder of `single` and `double`; double.h turns every float into a double, and has libm's
    functions."""
    folder = tmp_path_factory.mktemp("endurance")
    flags = [flag for flag in tools.core_flags(build_dir) if not flag.startswith("-W")]
    compiler: list[str | Path] = [tools.first_installed("cc|gcc|clang"), *flags, "-O2", "-I", tools.ROOT / "tests/unit"]
    single = build_dir / "firmware/liblever_cdkf.a"
    double = [source for source in tools.core_sources() if source not in FACADE and source.parent.name != "math"]
    to_double: list[str | Path] = ["-include", FOLDER / "double.h"]
    tools.assert_silent([*compiler, FOLDER / "main.c", single, "-lm", "-o", folder / "single"])
    tools.assert_silent([*compiler, *to_double, *double, FOLDER / "main.c", "-lm", "-o", folder / "double"])
    return folder


@cache
def flown(program: Path, scene: str, estimator: int, settings: str, seconds: int = SECONDS) -> np.ndarray:
    """Columns: time [s], then value and standard deviation of each parameter."""
    result = tools.run([program, scene, str(estimator), settings, str(seconds)])
    assert result.returncode == 0, "the belief broke its invariant"
    return np.array([line.split() for line in result.stdout.splitlines()], dtype=np.float64)


@pytest.mark.requires("cc|gcc|clang")
@pytest.mark.parametrize(
    ("scene", "settings", "within", "share"), [("calm", "plain", 0.003, 0.99), ("drift", "default", 0.05, 0.99)]
)
@pytest.mark.parametrize(("estimator", "name"), enum_names("lever_estimator").items())
@pytest.mark.requirement("R2")
def test_single_precision_goes_where_double_goes(
    programs: Path, scene: str, settings: str, within: float, share: float, estimator: int, name: str
) -> None:
    """`within`: greatest difference of the two in standard deviations, and of the standard deviations, relatively, for
    a `share` of the time: a comparison with a threshold that goes the other way in single precision is forgotten."""
    with ThreadPoolExecutor() as pool:
        both = pool.map(lambda precision: flown(programs / precision, scene, estimator, settings), ("single", "double"))
    single, double = both
    assert len(single) == len(double) == SECONDS * LINES_A_SECOND
    value, sigma = slice(1, None, 2), slice(2, None, 2)
    for difference in ((single - double)[:, value] / double[:, sigma], single[:, sigma] / double[:, sigma] - 1.0):
        assert np.quantile(np.abs(difference).max(axis=1), share) <= within


@pytest.mark.requires("cc|gcc|clang")
def test_the_two_scenes_are_what_they_claim(programs: Path) -> None:
    """Drift: followed, with a small sigma, most of it what is stated of the sensors. Calm: little is learnt, and
    uncertainty does not wind up."""
    drift = flown(programs / "single", "drift", 0, "default")
    calm = flown(programs / "single", "calm", 0, "default", SECONDS // 4)
    drift_sigma, calm_sigma = (np.median(run[:, 6] / run[:, 5]) for run in (drift, calm))
    assert drift[600:, 5].max() / drift[600:, 5].min() > 1.8
    assert drift_sigma < 0.09
    assert calm_sigma > 2.0 * drift_sigma
    own = setting("m_p_sigma").default  # what is stated of the sensors comes on top
    assert (calm[:, 2] / calm[:, 1]).max() <= 1.25 * own
