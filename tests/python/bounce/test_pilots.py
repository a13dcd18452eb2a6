"""The pilots of `lever bounce`: who relaxes, drifts, grips or moves, and by how much."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lever_sil.batch import motions
from lever_sil.bounce import pilots
from lever_sil.scenarios.scenario import Scenario
from lever_sil.toml_tables import Place, read


def number(written: str) -> float:
    return float(written.split()[0])


def flown(pilot: dict[str, Any], seconds: float) -> dict[str, np.ndarray]:
    """Return the true parameters of a pilot over time, at every tenth of a second."""
    values = {"title": "t", "duration": f"{seconds} s", "pilot": pilot}
    scenario: Scenario = read(Scenario, values, Place("t"))
    truth = scenario.truth(scenario.time())
    return {name: column[::100] for name, column in {**truth.parameters, "trim": truth.rest}.items()}


def test_an_arm_is_that_of_others_of_its_seed() -> None:
    for seed in (0, 5):
        values = pilots.arm(seed)
        drawn = (float(each[0, 0]) for each in motions.arms([seed]))
        assert values == dict(zip(("m_p", "c_p", "k_p", "trim"), drawn, strict=True))
        assert pilots.arm(seed, 18.0) == values | {"c_p": 18.0}
        assert pilots.table(values) == {
            "m_p": f"{values['m_p']} kg", "c_p": f"{values['c_p']} N s/m", "k_p": f"{values['k_p']} N/m",
            "trim": f"{values['trim']} rad",
        }  # fmt: skip
    assert (pilots.SLACK, pilots.TAUT) == (18.0, 42.0)


def test_who_relaxes_loses_damping_from_10_to_40_s() -> None:
    c_p = flown(pilots.relaxing(3), 50.0)["c_p"]
    time = 0.1 * np.arange(500)
    np.testing.assert_allclose(c_p, np.interp(time, (10.0, 40.0), (42.0, 18.0)), atol=1e-6)
    sudden = flown(pilots.relaxing(3, 25.0, 0.2), 30.0)["c_p"]
    assert (sudden[249], sudden[253]) == pytest.approx((42.0, 18.0))


def test_who_grips_tightens_within_a_twentieth_of_a_second() -> None:
    values, arm = flown(pilots.gripping(3, 2.0, 1.4), 3.0), pilots.arm(3)
    for name, before in (("c_p", 18.0), ("k_p", arm["k_p"])):
        assert (values[name][20], values[name][21]) == pytest.approx((before, 1.4 * before))
    np.testing.assert_allclose(values["m_p"], arm["m_p"])


def test_the_restless_drift_grip_or_move_in_turn() -> None:
    for seed in (3, 6):
        values, arm = flown(pilots.restless(seed, 120.0), 120.0), pilots.arm(seed)
        for name in ("m_p", "c_p", "k_p"):
            share = values[name] / arm[name]
            assert 0.6 - 1e-9 <= share.min() < share.max() <= 1.6 + 1e-9
            steps = np.diff(np.log(values[name]))
            assert np.std(steps) == pytest.approx(0.03 * math.sqrt(0.1), rel=0.15)
        np.testing.assert_allclose(values["trim"], arm["trim"])
    for seed in (4, 7):
        values, arm = flown(pilots.restless(seed, 120.0), 120.0), pilots.arm(seed)
        changes = 0.1 * np.flatnonzero(np.diff(values["k_p"])) + 0.1
        assert len(changes) == 7
        assert all(15.0 * (i + 1) <= at + 0.01 <= 15.0 * (i + 1) + 5.11 for i, at in enumerate(changes))
        for name in ("c_p", "k_p"):
            factors = values[name] / arm[name]
            assert 0.6 <= factors.min() < 1.0 < factors.max() <= 1.6
        np.testing.assert_allclose(values["c_p"] / arm["c_p"], values["k_p"] / arm["k_p"])
        np.testing.assert_allclose(values["m_p"], arm["m_p"])
    for seed in (5, 8):
        values, arm = flown(pilots.restless(seed, 120.0), 120.0), pilots.arm(seed)
        np.testing.assert_allclose(values["k_p"], arm["k_p"])
        moved = values["trim"] - values["trim"].mean()
        assert np.degrees(np.std(moved)) == pytest.approx(1.5, rel=0.05)
        power = np.abs(np.fft.rfft(moved)) ** 2
        frequency = np.fft.rfftfreq(len(moved), 0.1)
        assert power[(frequency > 0.045) & (frequency < 0.51)].sum() > 0.99 * power.sum()
        assert power[frequency > 0.4].sum() > 0.05 * power.sum()
