"""Without the base acceleration: why arm and base cannot be told apart, and what the firmware does."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.firmware.config import setting
from lever_sil.study import no_accelerometer
from lever_sil.study.no_accelerometer import BASES, assumptions, density, firmware, likeliest, runs, shaped

FLAT = next(iter(BASES))


def test_arm_and_shaping_filter_may_be_exchanged() -> None:
    """Both are resonances in series: the output has the same spectrum with their frequencies and dampings swapped."""
    frequency = np.linspace(1.0, 10.0, 91)
    (arm, zeta), (centre, damping) = np.log((4.0, 0.3)), np.log((2.5, 0.6))
    level = 4.0  # far above the process noise
    one = density(frequency, np.array((arm, zeta, level, centre, damping)), shaped)
    swapped = level + np.log(0.6 / 2.5) - np.log(0.3 / 4.0) + 2.0 * np.log(2.5 / 4.0)
    other = density(frequency, np.array((centre, damping, swapped, arm, zeta)), shaped)
    np.testing.assert_allclose(one, other, rtol=1e-3)


@pytest.mark.parametrize("base", BASES)
def test_each_base_shakes_by_a_tenth_of_g(base: str) -> None:
    _, z_ddot, _ = runs(base, 2, 4.0)
    assert np.std(z_ddot, axis=1) == pytest.approx(0.981, rel=0.05)


@pytest.fixture(scope="module")
def flat() -> tuple[np.ndarray, np.ndarray]:
    y, _, truth = runs(FLAT, 3, 30.0)
    return y, truth


def test_the_spectrum_must_be_known(flat: tuple[np.ndarray, np.ndarray]) -> None:
    """Known but for its level: frequency and damping are found as well as is stated. With a shaping filter: not."""
    y, truth = flat
    known = likeliest(y, truth, *assumptions(FLAT)["its spectrum but for the level"])
    assert (np.abs(known.error) <= 3.0 * known.sigma).all()
    assert np.abs(known.error[:, 0]).max() < 0.05
    free = likeliest(y, truth, *assumptions(FLAT)["second-order shaping filter"])
    assert np.median(np.abs(free.error[:, 0])) > 0.05


def test_the_firmware_keeps_its_first_guess_and_says_so(flat: tuple[np.ndarray, np.ndarray]) -> None:
    """Its natural frequency is that of the guess, its sigma still covers, and BASE is set after the start."""
    y, truth = flat
    found, flagged = firmware(y, truth)
    said = (1.0 + found.error) * truth
    assert np.ptp(said[:, 0]) < 0.02 * said[0, 0], "the same for each pilot"
    assert (flagged > 0.95).all()
    assert (np.abs(found.error) <= 2.0 * found.sigma).all()
    assert setting("k_p_sigma").default > found.sigma[:, 0].max() > 0.1


def test_the_table_is_that_of_the_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(no_accelerometer, "BASES", {FLAT: BASES[FLAT]})
    rows = no_accelerometer.rows(2, 10.0)
    assert [str(row["assumed of it"]).split(",")[0] for row in rows][-1] == "nothing: the firmware"
    y, _, truth = runs(FLAT, 2, 10.0)
    error = 100.0 * np.abs(likeliest(y, truth, *assumptions(FLAT)["white"]).error[:, 0])
    assert rows[0]["f_n: error [%]"] == f"{np.median(error):.1f} / {np.max(error):.1f}"
