"""The correction of the firmware, against the response of the arm in double precision."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.can.commander import KEEP_ALIVE
from lever_cdkf.firmware.aircraft import Correction
from lever_cdkf.firmware.native import Config, Estimator
from lever_sil.plants import lever_plant
from python.plants.motion import TRIM

ARM = {"m_p": 2.5, "c_p": 30.0, "k_p": 1500.0}
LEVER = lever_plant.Lever.from_settings(Config().settings)
BASE = 0.5
"""[m/s^2]; the lever moves by less than a degree, about which it is linear."""


def feedthrough(frequency: float) -> complex:
    """θ/z̈ [rad/(m/s²)]."""
    columns = (np.full(1, value) for value in (*ARM.values(), TRIM))
    transfer = lever_plant.LeverTruth(LEVER, lever_plant.Truth(*columns), "trim").transfer(np.array([0]))
    s = 2j * np.pi * frequency
    return complex(np.polyval(transfer.numerator[0], s) / np.polyval(transfer.denominator[0], s))


def corrections(mitigation: str, frequency: float, seconds: float = 8.0) -> list[Correction]:
    """Return those of an estimator that knows the arm and is sent COMMANDs, on a base that moves by a sine of BASE."""
    settings = ARM | {f"{name}_sigma": 1e-3 for name in ARM}
    estimator = Estimator(Config(settings=settings, mitigation=mitigation))
    response, turn, found = BASE * feedthrough(frequency), 2.0 * np.pi * frequency, []
    for sample in range(round(1e3 * seconds)):
        if sample % round(1e3 * KEEP_ALIVE) == 0:
            estimator.command()
        phase = np.exp(1j * turn * 1e-3 * sample)
        moved = response * phase
        estimator.update(1000 * sample, TRIM + moved.imag, (1j * turn * moved).imag, 0.0, BASE * phase.imag)
        found.append(estimator.correction())
    return found


@pytest.mark.parametrize("frequency", [2.0, 3.5, 5.0, 8.0])
def test_cancellation_is_the_response_of_the_arm(frequency: float) -> None:
    angle = np.array([each.angle for each in corrections("cancellation", frequency)[4000:]])
    time = 1e-3 * np.arange(4000, 8000)
    amplitude = 2.0 * np.mean(angle * np.exp(-2j * np.pi * frequency * time)) * 1j / BASE
    assert abs(amplitude / -feedthrough(frequency) - 1.0) < 0.02  # 0.01 of it is the high-pass's at 2 Hz


def test_it_is_on_within_a_second() -> None:
    weight = np.array([each.weight for each in corrections("cancellation", 3.5, 2.0)])
    assert weight[0] == 0.0
    assert (np.diff(weight) >= 0.0).all()
    assert weight[1300] == 1.0  # of which 0.3 s are align_time


@pytest.mark.parametrize("mitigation", ["none", "damping"])
def test_nothing_is_corrected_without_being_asked_for(mitigation: str) -> None:
    assert set(corrections(mitigation, 3.5, 2.0)) == {Correction(0.0, 0.0)}
