"""Mayo's pilots: the hand's absolute acceleration over the cabin's is his transfer function."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_sil.plants.mayo_plant import HANDS, Mayo
from python.plants.motion import PERIOD, TRIM, body, columns, moved
from scipy import signal

LENGTH = 0.45
PUBLISHED = {
    "ectomorphic": ([5.19, 452.3], [1.0, 13.70, 452.3]),
    "mesomorphic": ([4.02, 555.4], [1.0, 13.31, 555.4]),
}
each = pytest.mark.parametrize("somatotype", HANDS)


def pilot(somatotype: str, count: int = 2) -> Mayo:
    return Mayo(HANDS[somatotype], LENGTH, *columns(count, TRIM))


@each
def test_the_hand_in_space_moves_as_published(somatotype: str) -> None:
    """Speed of the hand, cabin's and relative to it, against scipy's simulation of H on the cabin's speed."""
    base = np.random.default_rng(1).standard_normal(4000)
    theta, theta_dot = moved(body(pilot(somatotype, 4000), base), 4000).T
    z_dot = np.concatenate(([0.0], np.cumsum(0.5 * PERIOD * (base[1:] + base[:-1]))))
    _, hand, _ = signal.lsim(PUBLISHED[somatotype], z_dot, np.arange(4000) * PERIOD)
    relative = LENGTH * math.cos(TRIM) * theta_dot
    assert np.abs(z_dot + relative - hand).max() < 2e-4 * np.abs(hand).max()
    mean_rate = 0.5 * (theta_dot[1:] + theta_dot[:-1])
    assert np.abs(np.diff(theta) / PERIOD - mean_rate).max() < 3e-2 * np.abs(theta_dot).max()


@each
def test_answer_and_dynamics_are_those_of_the_published_transfer_function(somatotype: str) -> None:
    """theta / z_ddot = (H - 1) / s^2 / (l cos theta_0)."""
    frequency, (numerator, denominator) = np.linspace(0.3, 12.0, 30), PUBLISHED[somatotype]
    s = 2j * math.pi * frequency
    expected = (np.polyval(numerator, s) / np.polyval(denominator, s) - 1.0) / s**2 / (LENGTH * math.cos(TRIM))
    truth, pole = pilot(somatotype, 3), np.roots(denominator)[0]
    assert truth.transfer(np.array([1])).response(frequency)[0] == pytest.approx(expected)
    assert truth.dynamics.natural_frequency == pytest.approx(abs(pole) / (2 * math.pi))
    assert truth.dynamics.damping_ratio == pytest.approx(-pole.real / abs(pole))
