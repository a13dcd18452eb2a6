"""The arm with a stretch reflex, against its transfer function with the exact delay."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from lever_cdkf.host_tools.arrays import FloatArray
from lever_cdkf.sil.plants import lever_plant
from lever_cdkf.sil.plants.reflex_plant import Reflex
from lever_cdkf.sil.plants.truth import Conditions

PERIOD, TRIM = 1e-3, 0.35
LEVER = lever_plant.Lever(0.45, 1.2, 0.5, 0.020, 0.5, 5.0, 0.0, 0.0)
ARM = (3.2, 50.0, 1800.0)


def reflex(k_r: float = 300.0, c_r: float = 15.0, delay: float = 0.035, count: int = 2) -> Reflex:
    return Reflex(LEVER, delay, *(np.full(count, value) for value in (*ARM, k_r, c_r, TRIM)))


def moved(truth: Reflex, base: FloatArray) -> FloatArray:
    body = truth.body(Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    path = [body.theta]
    for _ in range(len(base) - 1):
        body.advance(0.0)
        path.append(body.theta)
    return np.array(path) - TRIM


def exact(truth: Reflex, hertz: float) -> complex:
    """theta/z_ddot from the equation of motion, linearised, with exp(-s T)."""
    s, rise = 2j * math.pi * hertz, 0.45 * math.cos(TRIM)
    m_p, c_p, k_p = ARM
    k_r, c_r = float(truth.k_r[0]), float(truth.c_r[0])
    mass = 0.45**2 * (0.25 * 1.2 + m_p) + 0.020
    late = cmath.exp(-s * truth.delay) * (k_r + c_r * s)
    return -rise * (0.6 + m_p) / (mass * s**2 + 0.5 * s + 5.0 + rise**2 * (c_p * s + k_p + late))


@pytest.mark.parametrize("delay", [0.030, 0.035, 0.040])
def test_the_transfer_function_has_the_delay(delay: float) -> None:
    truth, frequency = reflex(delay=delay), np.linspace(0.3, 10.0, 30)
    found = truth.transfer(np.array([0, 1])).response(frequency)
    for row in found:
        assert row == pytest.approx([exact(truth, hertz) for hertz in frequency], rel=1e-5)


@pytest.mark.parametrize(("delay", "hertz"), [(0.035, 2.0), (0.0334, 3.5), (0.04, 8.0)])
def test_the_simulated_answer_is_that_of_the_transfer_function(delay: float, hertz: float) -> None:
    """The last second of three, whole cycles; small, so that the lever is linear."""
    time = np.arange(3000) * PERIOD
    truth = reflex(delay=delay, count=3000)
    path = moved(truth, 0.01 * np.sin(2 * math.pi * hertz * time))
    found = np.exp(-2j * math.pi * hertz * time[2000:]) @ path[2000:] * 2j / 1000 / 0.01
    assert found == pytest.approx(exact(truth, hertz), rel=1e-3)


def test_it_acts_one_delay_late_and_without_gain_not_at_all() -> None:
    base = np.where(np.arange(200) < 20, 3.0, 0.0)
    with_reflex, without = moved(reflex(count=200), base), moved(reflex(0.0, 0.0, count=200), base)
    assert np.array_equal(with_reflex[:35], without[:35])
    assert np.abs(with_reflex - without).max() > 0.05 * np.ptp(without)
    alone = reflex(count=200).arm.body(Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(0)))
    for angle in without[:-1]:
        assert alone.theta - TRIM == angle
        alone.advance(0.0)


def test_a_late_spring_takes_damping_away_and_a_late_damper_stiffens() -> None:
    plain, spring, damper = (reflex(*gains).dynamics for gains in ((0.0, 0.0), (400.0, 0.0), (0.0, 15.0)))
    assert spring.damping_ratio[0] < 0.85 * plain.damping_ratio[0]
    assert damper.natural_frequency[0] > 1.05 * plain.natural_frequency[0]
