"""Without the base acceleration: why arm and base cannot be told apart, and what the firmware does."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config, setting
from lever_cdkf.models.lever import Lever
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


def test_what_is_drawn_is_a_pilot_about_the_first_guess_in_rough_air() -> None:
    """At rest at 20°, his parameters within a quarter of the guess on either side; each run another."""
    y, z_ddot, truth = runs(FLAT, 40, 1.0)
    assert np.degrees(y[..., 0].mean()) == pytest.approx(20.0, abs=0.2)
    assert np.std(np.diff(y[..., 1])) == pytest.approx(np.sqrt(2.0) * 0.01, rel=0.2)
    lever = Lever.from_settings(Config().settings, "trim")
    guess = np.array([Config().settings[name] for name in ("m_p", "c_p", "k_p")])
    softest, stiffest = (lever.dynamics((guess * factor)[:, None], np.radians(20.0))[0, 0] for factor in (
        (1.25, 1.0, 0.75), (0.75, 1.0, 1.25)
    ))  # fmt: skip
    assert softest < truth[:, 0].min() < truth[:, 0].max() < stiffest
    assert np.ptp(truth[:, 0]) > 0.5 * (stiffest - softest)
    assert len(np.unique(z_ddot[:, 100])) == 40
    assert (y.shape, z_ddot.shape, truth.shape) == ((40, 1000, 2), (40, 1000), (40, 2))


def test_bases_are_flat_or_a_rotor() -> None:
    time = 0.01 * np.arange(2000.0)
    flat, narrow, rotor = (shake.samples(time, np.random.default_rng(1)) for shake in BASES.values())
    frequency = np.fft.rfftfreq(len(flat), 0.01)
    for signal, low, high in ((flat, 1.0, 10.0), (narrow, 2.0, 6.0), (rotor, 4.2, 8.7)):
        power = np.abs(np.fft.rfft(signal)) ** 2
        inside = (frequency >= 0.95 * low) & (frequency <= 1.05 * high)
        assert power[inside].sum() > 0.98 * power.sum()
        assert power[(frequency >= low) & (frequency < 1.3 * low)].sum() > 0.005 * power.sum()
    peaks = frequency[np.abs(np.fft.rfft(rotor)) > 0.3 * np.abs(np.fft.rfft(rotor)).max()]
    assert np.abs(peaks[:, None] - np.array((4.3, 8.6))).min(axis=0).max() < 0.06


def test_what_may_be_assumed_of_a_base() -> None:
    frequency = np.array((0.9, 1.0, 1.9, 2.0, 6.0, 6.1, 10.0, 10.1))
    for base, low, high in (("flat, 1-10 Hz", 1.0, 10.0), ("flat, 2-6 Hz", 2.0, 6.0)):
        (white, _), (filtered, start), (known, nothing) = assumptions(base).values()
        assert white(frequency, np.empty(0)).tolist() == [1.0] * 8
        assert known(frequency, np.empty(0)).tolist() == [float(low <= each <= high) for each in frequency]
        assert filtered is shaped
        assert np.exp(start) == pytest.approx((4.0, 0.7))
        assert nothing == ()
    assert list(assumptions("rotor, 4.3 Hz and harmonics")) == ["white", "second-order shaping filter"]
    peak = shaped(np.array((2.0, 4.0, 8.0)), np.log((4.0, 0.5)))
    assert peak == pytest.approx((1.0 / (1.0 + 1.5**2), 1.0, 1.0 / (1.0 + 1.5**2)))


def test_the_spectral_density_is_that_of_an_oscillator_shaken_by_base_and_air() -> None:
    """theta / a = 1 / (w0^2 - w^2 + 2 i zeta w0 w); air moves theta_dot by 0.05 rad/s/sqrt(s), base by its level."""
    frequency = np.array((1.0, 3.0, 7.0))
    s, natural, zeta, level = 2j * np.pi * frequency, 2.0 * np.pi * 4.0, 0.3, 2.0
    answer = np.abs(1.0 / (natural**2 + s**2 + 2.0 * zeta * natural * s)) ** 2
    free = np.log((4.0, zeta, level))
    white = assumptions(FLAT)["white"][0]
    np.testing.assert_allclose(density(frequency, free, white), (level**2 + 0.05**2) * answer, rtol=1e-9)


def test_the_table_has_median_worst_bias_and_coverage(monkeypatch: pytest.MonkeyPatch) -> None:
    error = np.array(((0.01, -0.1), (-0.02, -0.2), (0.04, -0.6)))
    found = no_accelerometer.Found(error, np.array(((0.02, 0.01), (0.02, 0.11), (0.01, 0.31))))
    nothing = np.zeros((1, 1))
    monkeypatch.setattr(no_accelerometer, "runs", lambda *_: (nothing, nothing, nothing))
    monkeypatch.setattr(no_accelerometer, "likeliest", lambda *_: found)
    monkeypatch.setattr(no_accelerometer, "firmware", lambda *_: (found, nothing))
    rows = no_accelerometer.rows(3, 1.0)
    assert [(row["base"], row["assumed of it"]) for row in rows] == [
        (base, what)
        for base in BASES
        for what in (*(f"{name}, likeliest" for name in assumptions(base)), "nothing: the firmware")
    ]
    for row in rows:
        assert {name: value for name, value in row.items() if name not in ("base", "assumed of it")} == {
            "f_n: error [%]": "2.0 / 4.0", "f_n: bias [%]": "+1.0", "f_n: ±2σ covers [%]": "67",
            "ζ: error [%]": "20.0 / 60.0", "ζ: bias [%]": "-30.0", "ζ: ±2σ covers [%]": "67",
        }  # fmt: skip
    assert (no_accelerometer.SEEDS, no_accelerometer.DURATION) == (20, 60.0)
