"""Units that nobody says: what values look like, and what no lever and no aircraft has."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.host_tools.errors import LeverError
from lever_cdkf.host_tools.signals.units import check_plausible, gravity_in, guess


@pytest.mark.parametrize(
    ("key", "value", "unit"),
    [
        ("theta", -3.14, "rad"),
        ("theta", 3.15, "deg"),
        ("theta_dot", -20.0, "rad/s"),
        ("theta_dot", 20.1, "deg/s"),
        ("z_ddot", 0.86, "g"),
        ("z_ddot", -1.14, "g"),
        ("z_ddot", 8.4, "m/s^2"),
        ("z_ddot", -11.2, "m/s^2"),
        ("tau_m", 1e4, "N m"),
    ],
)
def test_the_unit_is_that_of_the_size(key: str, value: float, unit: str) -> None:
    """Of all but a hundredth, without what is missing."""
    values = np.full(1000, value)
    values[:5], values[5:100] = 1e6, np.nan
    assert guess(key, values)[0] == unit


@pytest.mark.parametrize("level", [0.0, 0.84, 1.16, 8.3, 11.3])
def test_an_acceleration_without_gravity_is_not_guessed(level: float) -> None:
    with pytest.raises(LeverError, match="say unit=g or unit="):
        guess("z_ddot", np.full(100, level))


def test_gravity_has_a_sign() -> None:
    assert [gravity_in(np.full(9, level)) for level in (8.4, -11.2, 8.3, 11.3, 0.0, np.nan)] == [1, -1, 0, 0, 0, 0]


@pytest.mark.parametrize(
    ("key", "greatest"),
    [("theta", 3.15), ("theta_dot", 20.1), ("z_ddot", 80.1), ("tau_m", 1001), ("grip_force", 10_001)],
)
def test_more_than_a_hundredth_beyond_what_there_is_means_another_unit(key: str, greatest: float) -> None:
    values = np.zeros(1000)
    values[:10] = -greatest
    check_plausible(key, "it", values)
    values[10] = greatest
    with pytest.raises(LeverError, match=f"{key} = it: 1 % of it is beyond"):
        check_plausible(key, "it", values)
    check_plausible(key, "it", np.full(1000, 0.99 * greatest))
    check_plausible(key, "it", np.full(3, np.nan))
