"""The arm with a stretch reflex, against its transfer function with the exact delay; test_truths.py shakes it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_sil.plants.reflex_plant import Reflex
from python.plants.motion import LEVER, TRIM, body, columns, moved

ARM = (3.2, 50.0, 1800.0)


def reflex(k_r: float = 300.0, c_r: float = 15.0, delay: float = 0.035, count: int = 2) -> Reflex:
    return Reflex(LEVER, delay, *columns(count, *ARM, k_r, c_r, TRIM))


@pytest.mark.parametrize("delay", [0.030, 0.040])
def test_the_transfer_function_has_the_delay(delay: float) -> None:
    """theta/z_ddot from the equation of motion, linearised, with exp(-s T)."""
    frequency = np.linspace(0.3, 10.0, 30)
    s, rise, (m_p, c_p, k_p) = 2j * math.pi * frequency, 0.45 * math.cos(TRIM), ARM
    mass = 0.45**2 * (0.25 * 1.2 + m_p) + 0.020
    late = np.exp(-s * delay) * (300.0 + 15.0 * s)
    expected = -rise * (0.6 + m_p) / (mass * s**2 + 0.5 * s + 5.0 + rise**2 * (c_p * s + k_p + late))
    found = reflex(delay=delay).transfer(np.array([0, 1])).response(frequency)
    np.testing.assert_allclose(found, [expected] * 2, rtol=1e-5)


def test_it_acts_one_delay_late_and_without_gain_not_at_all() -> None:
    base = np.where(np.arange(200) < 20, 3.0, 0.0)
    late, without = (moved(body(reflex(*gains, count=200), base), 200) for gains in ((300.0, 15.0), (0.0, 0.0)))
    assert np.array_equal(late[:35], without[:35])
    assert np.abs(late - without)[:, 0].max() > 0.05 * np.ptp(without[:, 0])
    assert np.array_equal(moved(body(reflex(count=200).arm, base), 200), without)


def test_a_late_spring_takes_damping_away_and_a_late_damper_stiffens() -> None:
    plain, spring, damper = (reflex(*gains).dynamics for gains in ((0.0, 0.0), (400.0, 0.0), (0.0, 15.0)))
    assert spring.damping_ratio[0] < 0.85 * plain.damping_ratio[0]
    assert damper.natural_frequency[0] > 1.05 * plain.natural_frequency[0]
