"""Recorded scenarios: what the bus carried, and what was true, for every estimator alike."""

from __future__ import annotations

import numpy as np
import pytest
from lever_sil.scenarios import scenario
from lever_sil.study.recorded import recorded, usable
from lever_sil.toml_tables import ScenarioError


def test_measured_is_the_truth_with_the_noise_of_the_sensors() -> None:
    batch = recorded("steady", 2, 1, 3.0)
    assert batch.raw_y.shape == (2, 3000, 2)
    sensors = scenario.load("steady").sensors
    noise = batch.raw_y - batch.truth.x
    for index, sigma in enumerate((sensors.theta.noise, sensors.theta_dot.noise)):
        assert noise[..., index].std() == pytest.approx(sigma, rel=0.05)
        assert abs(noise[..., index].mean()) < 5.0 * sigma / np.sqrt(noise[..., index].size)
    assert not np.array_equal(batch.raw_u[0], batch.raw_u[1]), "each seed shakes the lever in its own way"


def test_a_pilot_who_is_none_of_the_model_has_dynamics_and_no_parameters() -> None:
    batch, pilot = recorded("mayo_ectomorphic", 1, 1, 1.0), scenario.load("mayo_ectomorphic")
    assert batch.truth.p is None
    np.testing.assert_array_equal(
        batch.truth.dynamics[0, 0, 0], pilot.truth(pilot.time()).dynamics.natural_frequency[0]
    )


def test_fixed_preload_is_not_detrended() -> None:
    batch = recorded("fixed_preload", 1, 1, 1.0)
    np.testing.assert_array_equal(batch.y, batch.raw_y)
    np.testing.assert_array_equal(batch.trim, 0.0)


def test_dropouts_are_refused() -> None:
    assert not usable(scenario.load("sensor_dropout"))
    with pytest.raises(ScenarioError, match=r"sensor_dropout\.toml: has dropouts"):
        recorded("sensor_dropout", 1, 1)
