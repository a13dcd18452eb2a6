"""The arm with structural damping: a loss factor that is the same at every frequency."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.host_tools.arrays import ComplexArray, FloatArray
from lever_cdkf.sil.plants import lever_plant
from lever_cdkf.sil.plants.hysteretic_plant import REFERENCE, Hysteretic
from lever_cdkf.sil.plants.truth import Conditions

PERIOD, TRIM = 1e-3, 0.35
LEVER = lever_plant.Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, 0.0, 0.0)
RISE = 0.45 * math.cos(TRIM)
MASS = 0.45**2 * (0.25 * 1.2 + 3.2) + 0.020
FORCING = -RISE * (0.6 + 3.2)


def arm(loss_factor: float, count: int = 2) -> Hysteretic:
    return Hysteretic(LEVER, loss_factor, *(np.full(count, value) for value in (3.2, 2100.0, TRIM)))


def arm_stiffness(answer: ComplexArray, frequency: FloatArray) -> ComplexArray:
    """What the arm has to be [N/m] for theta/z_ddot to be `answer`."""
    s = 2j * math.pi * frequency
    stiffness: ComplexArray = (FORCING / answer - MASS * s**2 - 0.5 * s - 5.0) / RISE**2
    return stiffness


@pytest.mark.parametrize("loss_factor", [0.2, 0.6, 1.0])
def test_its_stiffness_is_a_power_of_frequency_with_a_constant_loss_factor(loss_factor: float) -> None:
    frequency = np.geomspace(0.2, 30.0, 40)
    found = arm_stiffness(arm(loss_factor).transfer(np.array([0])).response(frequency)[0], frequency)
    assert found.imag / found.real == pytest.approx(loss_factor, rel=0.013)
    power = 2 / math.pi * math.atan(loss_factor)
    assert found.real == pytest.approx(2100.0 * (frequency / REFERENCE) ** power, rel=0.005)


@pytest.mark.parametrize("hertz", [1.0, 3.0, 8.0])
def test_a_simulated_cycle_loses_the_same_share_of_its_energy_at_each_frequency(hertz: float) -> None:
    """Shaken by a small sine; the last of five seconds, whole cycles."""
    time = np.arange(5000) * PERIOD
    body = arm(0.6, 5000).body(
        Conditions(0.01 * np.sin(2 * math.pi * hertz * time), PERIOD, 0.0, 0.0, np.random.default_rng(0))
    )
    path = np.empty(5000)
    for k in range(5000):
        path[k] = body.theta - TRIM
        if k < 4999:
            body.advance(0.0)
    answer = np.exp(-2j * math.pi * hertz * time[4000:]) @ path[4000:] * 2j / 1000 / 0.01
    found = arm_stiffness(np.array([answer]), np.array([hertz]))[0]
    assert found.imag / found.real == pytest.approx(0.6, rel=0.02)


def test_the_arm_goes_along_with_the_trim() -> None:
    truth = arm(0.6, 6000)
    truth.trim[1000:] = 0.5
    body = truth.body(Conditions(np.zeros(6000), PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    for _ in range(5999):
        body.advance(0.0)
    assert body.theta == pytest.approx(0.5, abs=0.01 * 0.15)  # what relaxes slowest has not yet
