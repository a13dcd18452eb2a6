"""What is measured in a condition: units, how runs are pooled, and the pilots that are no mass on a spring."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.batch import pilots
from lever_sil.batch.motions import EVENT, FREQUENCIES, Motion, arms
from lever_sil.envelope.measure import FIGURES, QUANTITIES
from lever_sil.plants import hysteretic_plant, lever_plant, mayo_plant, reflex_plant, two_dof_plant

PERCENT, SECONDS, SIGMAS = ("%", "mean", True), ("s", "largest", True), ("σ", "largest", True)
KNOWN: dict[str, tuple[str, str, bool]] = {
    **{f"{name} rms": ("%", "rms", True) for name in QUANTITIES},
    **{f"{name} covered": ("%", "mean", False) for name in QUANTITIES},
    **{f"{name} largest": SIGMAS for name in QUANTITIES},
    **{f"σ({name}) ratio": ("1", "mean", True) for name in QUANTITIES},
    **{f"{name} ratio": ("1", "rms", True) for name in QUANTITIES},
    **{f"{name} share": PERCENT for name in ("CALIBRATION", "CHANGE", "EXCITATION", "MISMATCH", "silent")},
    "flagged": PERCENT,
    "unflagged": SIGMAS,
    "silent": SECONDS,
    "changes": ("1/h", "mean", True),
    "mismatch": ("%", "mean", False),
    "running": ("%", "mean", False),
    "settled": SECONDS,
    "lag": ("s", "mean", True),
    "to flag": SECONDS,
    "to HANDS_OFF": SECONDS,
    "back": SECONDS,
    "learnt at once": SIGMAS,
    "learnt": SIGMAS,
    "learnt late": SIGMAS,
    "σ ratio": ("1", "largest", True),
    "θ/z̈ rms": ("%", "rms", True),
    "θ/z̈ covered": ("%", "mean", False),
}
"""Unit, what is made of all runs, and whether more is worse."""
OF_3_1_2 = {"largest": 3.0, "mean": 2.0, "rms": math.sqrt(14.0 / 3.0)}


def test_figures_have_their_unit_and_are_pooled_as_they_are_meant() -> None:
    values = np.array([3.0, 1.0, 2.0])
    assert FIGURES.keys() == KNOWN.keys()
    assert QUANTITIES == ("f_n", "zeta", "m_p", "c_p", "k_p")
    for name, (unit, pooled, more_is_worse) in KNOWN.items():
        figure = FIGURES[name]
        assert (figure.unit, figure.more_is_worse) == (unit, more_is_worse), name
        assert figure.pool(values) == pytest.approx(OF_3_1_2[pooled]), name
        assert figure.worst(values) == (3.0 if more_is_worse else 1.0), name
        assert math.isinf(figure.sought_to)


# --- pilots ----------------------------------------------------------------------------------------------------------

ONE = np.ones(1)


def response(pilot: str, seed: int) -> np.ndarray:
    recorded = pilots.record(Motion(duration=0.1, torque=(), pilot=pilot), [seed]).response
    assert recorded is not None
    found: np.ndarray = recorded[0]
    return found


def arm(seed: int) -> list[FloatArray]:
    """Return m_p, c_p, k_p and trim of others of that seed."""
    return [np.full(1, values[0, 0]) for values in arms([seed])]


def test_pilots_of_other_models_are_those_of_their_seed() -> None:
    """A loss factor of 0.6; a reflex after 35 ms with a quarter of the stiffness; Mayo's two."""
    lever = lever_plant.Lever.from_settings(Config().settings)
    m_p, c_p, k_p, trim = arm(5)
    made = {
        "hysteretic": hysteretic_plant.Hysteretic(lever, 0.6, m_p, k_p, trim),
        "reflex": reflex_plant.Reflex(lever, 0.035, m_p, c_p, k_p, 0.25 * k_p, 0.0 * ONE, trim),
        "mayo_ectomorphic": mayo_plant.Mayo(mayo_plant.HANDS["ectomorphic"], lever.lever_length, trim),
        "mayo_mesomorphic": mayo_plant.Mayo(mayo_plant.HANDS["mesomorphic"], lever.lever_length, trim),
    }
    for name, truth in made.items():
        expected = truth.transfer(np.zeros(1, np.intp)).response(FREQUENCIES)[0]
        np.testing.assert_allclose(response(name, 5), expected, rtol=1e-9)


def test_an_arm_on_a_trunk_is_off_by_10_percent_about_that_of_its_scenario() -> None:
    lever = lever_plant.Lever.from_settings(Config().settings)

    def of(m_p: float, c_p: float, k_p: float, trim: FloatArray) -> np.ndarray:
        m_t, c_t, k_t = (two_dof_plant.TRUNK_MASS, two_dof_plant.TRUNK_DAMPING, two_dof_plant.TRUNK_STIFFNESS)
        truth = two_dof_plant.TwoDof(lever, m_p * ONE, c_p * ONE, k_p * ONE, m_t * ONE, c_t * ONE, k_t * ONE, trim)
        found: np.ndarray = truth.transfer(np.zeros(1, np.intp)).response(FREQUENCIES)[0]
        return found

    ratios, stiffer = [], []
    for seed in range(60):
        trim = arm(seed)[3]
        usual = of(3.2, 60.0, 2100.0, trim)
        ratios.append(abs(response("two_dof", seed)[0] / usual[0]))
        stiffer.append(abs(of(3.2, 60.0, 2100.0 * math.exp(0.1), trim)[0] / usual[0]))
    assert np.mean(np.log(ratios)) == pytest.approx(0.0, abs=0.05)
    by_stiffness = abs(np.log(np.mean(stiffer)))
    assert 0.8 * by_stiffness < np.std(np.log(ratios)) < 2.5 * by_stiffness


def test_hands_at_random_lie_about_mayos_two() -> None:
    """At the lowest frequency both are within the spread of the others."""
    sizes = np.array([abs(response("mayo_random", seed)[0]) for seed in range(60)])
    for name in ("mayo_ectomorphic", "mayo_mesomorphic"):
        assert sizes.min() < abs(response(name, 1)[0]) < sizes.max()
    assert len(set(sizes.round(9))) == 60
    assert 0.1 < np.std(np.log(sizes)) < 0.8


def test_what_happens_once_begins_after_half_a_minute() -> None:
    assert EVENT == 30.0
    assert (FREQUENCIES[0], FREQUENCIES[-1], len(FREQUENCIES)) == (2.0, 8.0, 25)
