"""Mayo's pilots: the hand's absolute acceleration over the cabin's is his transfer function."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.sil.plants.mayo_plant import HANDS, Mayo
from lever_cdkf.sil.plants.truth import Conditions
from numpy.typing import NDArray
from scipy import signal

PERIOD, LENGTH, TRIM = 1e-3, 0.45, 0.35
PUBLISHED = {
    "ectomorphic": ([5.19, 452.3], [1.0, 13.70, 452.3]),
    "mesomorphic": ([4.02, 555.4], [1.0, 13.31, 555.4]),
}


def pilot(somatotype: str, count: int = 2) -> Mayo:
    return Mayo(HANDS[somatotype], LENGTH, np.full(count, TRIM))


def moved(somatotype: str, base: NDArray[np.float64]) -> NDArray[np.float64]:
    """(samples, 2): theta - trim and theta_dot."""
    body = pilot(somatotype, len(base)).body(Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    path = [(body.theta, body.theta_dot)]
    for _ in range(len(base) - 1):
        body.advance(0.0)
        path.append((body.theta, body.theta_dot))
    return np.array(path) - (TRIM, 0.0)


@pytest.mark.parametrize("somatotype", HANDS)
def test_the_hand_in_space_moves_as_published(somatotype: str) -> None:
    """Speed of the hand, cabin's and relative to it, against scipy's simulation of H on the cabin's speed."""
    base = np.random.default_rng(1).standard_normal(4000)
    time = np.arange(4000) * PERIOD
    path = moved(somatotype, base)
    z_dot = np.concatenate(([0.0], np.cumsum(0.5 * PERIOD * (base[1:] + base[:-1]))))
    _, hand, _ = signal.lsim(PUBLISHED[somatotype], z_dot, time)
    relative = LENGTH * math.cos(TRIM) * path[:, 1]
    assert np.abs(z_dot + relative - hand).max() < 2e-4 * np.abs(hand).max()


@pytest.mark.parametrize("somatotype", HANDS)
def test_the_rate_is_the_derivative_of_the_angle(somatotype: str) -> None:
    base = np.sin(2 * math.pi * 3.0 * np.arange(2000) * PERIOD)
    theta, theta_dot = moved(somatotype, base).T
    assert np.abs(np.gradient(theta, PERIOD)[1:-1] - theta_dot[1:-1]).max() < 1e-3 * np.abs(theta_dot).max()


@pytest.mark.parametrize("somatotype", HANDS)
def test_the_answer_to_the_floor_is_the_hand_without_the_cabin(somatotype: str) -> None:
    """theta / z_ddot = (H - 1) / s^2 / (l cos theta_0)."""
    frequency = np.linspace(0.3, 12.0, 30)
    s = 2j * math.pi * frequency
    hand = np.polyval(PUBLISHED[somatotype][0], s) / np.polyval(PUBLISHED[somatotype][1], s)
    expected = (hand - 1.0) / s**2 / (LENGTH * math.cos(TRIM))
    assert pilot(somatotype, 3).transfer(np.array([1])).response(frequency)[0] == pytest.approx(expected)


@pytest.mark.parametrize("somatotype", HANDS)
def test_the_dynamics_are_the_poles_of_the_transfer_function(somatotype: str) -> None:
    pole = np.roots(PUBLISHED[somatotype][1])[0]
    dynamics = pilot(somatotype).dynamics
    assert dynamics.natural_frequency == pytest.approx(abs(pole) / (2 * math.pi))
    assert dynamics.damping_ratio == pytest.approx(-pole.real / abs(pole))


def test_no_torque_moves_him() -> None:
    truth = pilot("ectomorphic", 10)
    body = truth.body(Conditions(np.zeros(10), PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    body.advance(1.0)
    assert (body.theta, body.theta_dot) == (TRIM, 0.0)
    assert not truth.takes_torque


def test_process_noise_shakes_the_lever_by_its_strength() -> None:
    count = 20_000
    truth = pilot("mesomorphic", count)
    body = truth.body(Conditions(np.zeros(count), PERIOD, 0.05, 0.0, np.random.default_rng(1)))
    kicks = np.empty(count - 1)
    for k in range(count - 1):
        body.theta, body.theta_dot = TRIM, 0.0
        body.advance(0.0)
        kicks[k] = body.theta_dot
    assert np.std(kicks) == pytest.approx(0.05 * math.sqrt(PERIOD), rel=0.03)
