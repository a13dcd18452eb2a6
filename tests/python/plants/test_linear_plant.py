"""The linear truths against scipy's state spaces: motion, response and modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_sil.plants.linear_plant import BlackBox, LinearTruth, Physical
from python.plants.motion import PERIOD, TRIM, body, columns, moved
from scipy import signal

SYSTEMS: dict[
    type[LinearTruth], tuple[tuple[float, float, float], Any, Any]
] = {  # matrix of the motion, and by z_ddot and tau_m, from the parameters of each
    Physical: ((3.2, 60.0, 2100.0), [[0, 1], [-2100.0 / 3.2, -60.0 / 3.2]], [[0, 0], [1, 1 / 3.2]]),
    BlackBox: ((-500.0, -14.0, -2.2), [[0, 1], [-500.0, -14.0]], [[0, 0], [-2.2, 0]]),
}


@pytest.mark.parametrize("kind", SYSTEMS)
def test_motion_dynamics_and_transfer_function_are_those_of_the_state_space(kind: type[LinearTruth]) -> None:
    """Shaken by noise that is linear between the samples and pushed by a constant torque."""
    count = 3000
    parameters, a, b = SYSTEMS[kind]
    truth, system = kind(*columns(count, *parameters, TRIM)), signal.StateSpace(a, b, [[1, 0]], [[0, 0]])
    base = np.random.default_rng(1).standard_normal(count)
    path = moved(body(truth, base), count, command=0.4)[:, 0]
    _, expected, _ = signal.lsim(system, np.column_stack((base, np.full(count, 0.4))), np.arange(count) * PERIOD)
    assert np.abs(path - expected).max() < 1e-4 * np.abs(expected).max()
    np.testing.assert_array_equal(list(truth.parameters.values()), columns(count, *parameters))
    pole = np.linalg.eigvals(np.array(a, np.float64))[0]
    np.testing.assert_allclose(truth.dynamics.natural_frequency, abs(pole) / (2 * math.pi))
    np.testing.assert_allclose(truth.dynamics.damping_ratio, -pole.real / abs(pole))
    frequency = np.array([0.5, 3.0, 9.0])
    expected = [np.linalg.solve(2j * math.pi * hertz * np.eye(2) - a, np.array(b)[:, 0])[0] for hertz in frequency]
    np.testing.assert_allclose(truth.transfer(np.array([0, 2])).response(frequency), [expected] * 2)
