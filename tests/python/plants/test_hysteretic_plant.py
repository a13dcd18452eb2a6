"""The arm with structural damping: a loss factor that is the same at every frequency."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_sil.plants.hysteretic_plant import Hysteretic
from python.plants.motion import LEVER, TRIM, columns

RISE = 0.45 * math.cos(TRIM)
MASS = 0.45**2 * (0.25 * 1.2 + 3.2) + 0.020


@pytest.mark.parametrize("loss_factor", [0.2, 0.6, 1.0])
def test_its_stiffness_is_a_power_of_frequency_with_a_constant_loss_factor(loss_factor: float) -> None:
    """What the arm has to be [N/m] for theta/z_ddot to be what it is; test_truths.py shakes it."""
    frequency = np.geomspace(0.2, 30.0, 40)
    s, arm = 2j * math.pi * frequency, Hysteretic(LEVER, loss_factor, *columns(2, 3.2, 2100.0, TRIM))
    answer = arm.transfer(np.array([0])).response(frequency)[0]
    stiffness = (-RISE * (0.6 + 3.2) / answer - MASS * s**2 - 0.5 * s - 5.0) / RISE**2
    assert stiffness.imag / stiffness.real == pytest.approx(loss_factor, rel=0.013)
    power = 2 / math.pi * math.atan(loss_factor)
    assert stiffness.real == pytest.approx(2100.0 * (frequency / 4.0) ** power, rel=0.005)
