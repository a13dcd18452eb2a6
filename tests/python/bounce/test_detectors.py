"""The detectors that the alarm is compared with, on made-up oscillations."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.bounce import detectors
from lever_sil.bounce.detectors import RATE, Watched

TIME = np.arange(20 * RATE) / RATE
ANSWER = cmath.rect(100.0, -1.2)
"""z_ddot / delta [m/s^2 per rad]."""


def oscillating(amplitude: float, frequency: float = 4.0, phase: float = 0.0) -> Watched:
    """z_ddot [m/s^2], and a lever that makes it so but for a phase; noise of a hundredth."""

    def sine(shift: float) -> FloatArray:
        return np.sin(2.0 * math.pi * frequency * TIME + shift)

    noise = np.random.default_rng(1).standard_normal((2, len(TIME))) * 0.01 * amplitude
    lever = amplitude * (sine(phase - cmath.phase(ANSWER)) + noise[0]) * detectors.LEVER_UNIT
    return Watched(lever, amplitude * (sine(0.0) + noise[1]))


def test_rover_finds_the_amplitude_of_an_oscillation_of_the_coupling() -> None:
    level = detectors.rover(oscillating(0.7), lambda s: ANSWER)
    assert level[5 * RATE :].min() == pytest.approx(0.7, rel=0.15)
    assert level[: round(0.5 * RATE)].max() == 0.0


@pytest.mark.parametrize(("frequency", "phase"), [(1.0, 0.0), (4.0, 2.0), (4.0, -2.0), (4.0, math.pi)])
def test_rover_does_not_take_other_oscillations_for_it(frequency: float, phase: float) -> None:
    level = detectors.rover(oscillating(0.7, frequency, phase), lambda s: ANSWER)
    assert level[5 * RATE :].max() < 0.1


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_rover_allows_a_phase_that_differs_by_60_degrees(way: float) -> None:
    """At 2 Hz, where a sample is 14°: 46° are taken for the coupling, 77° are not."""
    near, far = (detectors.rover(oscillating(0.7, 2.0, way * each), lambda s: ANSWER) for each in (0.8, 1.35))
    assert near[8 * RATE :].min() == pytest.approx(0.6, abs=0.05)
    assert far[8 * RATE :].max() < 0.1


@pytest.mark.parametrize(("frequency", "heard"), [(1.2, False), (1.6, True), (6.25, True), (9.0, False)])
def test_rover_hears_from_1_5_to_8_hz(frequency: float, heard: bool) -> None:
    level = detectors.rover(oscillating(0.7, frequency), lambda s: ANSWER)[8 * RATE :]
    assert (level.min() > 0.5) if heard else (level.max() < 0.1)


def test_rover_waits_for_five_half_cycles() -> None:
    """Five eighths of a second at 4 Hz, after the two that tell the phase."""
    level = detectors.rover(oscillating(0.7), lambda s: ANSWER)
    assert 0.6 < TIME[np.argmax(level > 0.35)] < 1.2


def test_the_spectrum_hears_from_2_to_8_hz_and_forgets_in_two_seconds() -> None:
    levels = {each: float(detectors.spectrum(oscillating(0.7, each))[-1]) for each in (1.5, 2.0, 5.0, 8.0, 9.0)}
    assert all(levels[each] > 0.6 for each in (2.0, 5.0, 8.0))
    assert all(levels[each] < 0.25 for each in (1.5, 9.0))
    level = detectors.spectrum(oscillating(0.7))
    assert level[2 * RATE - 1] == pytest.approx(0.7 * (1.0 - math.exp(-1.0)), rel=0.05)


def test_the_spectrum_has_the_amplitude_of_an_oscillation() -> None:
    level = detectors.spectrum(oscillating(0.7))
    assert level[-1] == pytest.approx(0.7, rel=0.05)
    risen = TIME[int(np.argmax(level > 0.7 * (1.0 - math.exp(-1.0))))]
    assert risen == pytest.approx(2.0, rel=0.1)
    assert detectors.spectrum(oscillating(0.7, 0.5))[-1] < 0.1


def test_thresholds_are_the_lowest_that_raise_no_alarm_in_ten_hours_of_stable_flight() -> None:
    """As `lever bounce --only false_alarms` has measured the greatest levels, rounded up."""
    assert detectors.THRESHOLDS == {
        "uh60_like": (0.947, 0.833), "puma_like": (0.949, 0.826), "bo105_like": (0.983, 0.920)
    }  # fmt: skip


def test_signals_are_watched_by_their_means() -> None:
    watched = Watched.of(np.arange(1010.0), np.ones(1010), 1e-3)
    assert len(watched.theta) == len(watched.z_ddot) == 50
    assert watched.theta[:2].tolist() == [9.5, 29.5]
    fast = Watched.of(np.arange(1000.0), np.ones(1000), 1e-4)
    assert fast.theta.tolist() == [99.5, 299.5, 499.5, 699.5, 899.5], "fifty in a second"
