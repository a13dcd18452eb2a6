"""Trajectories of the true parameters against their closed forms."""

import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.plants import trajectories
from lever_sil.toml_tables import Place, ScenarioError

TIME = np.arange(40_000, dtype=np.float64) * 1e-3


def trajectory(value: Any, unit: str = "N/m") -> trajectories.Trajectory:
    read: trajectories.Trajectory = trajectories.read_trajectory()(value, Place("x.toml", "pilot.k_p", unit))
    return read


def values(value: Any, seed: int = 0) -> FloatArray:
    return trajectory(value).values(TIME, np.random.default_rng(seed))


def test_a_bare_quantity_is_constant() -> None:
    assert np.all(values("2.1 N/mm") == 2100.0)
    assert trajectory("2.1 N/mm").changes() == ()


def test_steps_hold_their_values_from_their_times_on() -> None:
    steps = {"kind": "steps", "first": "1000 N/m", "at": ["10 s", "20 s"], "to": ["3000 N/m", "2000 N/m"]}
    at = values(steps)[[0, 9_999, 10_000, 19_999, 20_000, 39_999]]
    assert at.tolist() == [1000.0, 1000.0, 3000.0, 3000.0, 2000.0, 2000.0]
    assert trajectory(steps).changes() == (10.0, 20.0)


def test_ramp_is_straight_between_its_ends() -> None:
    ramp = values({"kind": "ramp", "first": "1000 N/m", "last": "2000 N/m", "start": "10 s", "duration": "8 s"})
    np.testing.assert_allclose(ramp, np.clip(1000.0 + 125.0 * (TIME - 10.0), 1000.0, 2000.0), rtol=1e-6)


def test_fatigue_falls_with_its_time_constant() -> None:
    fatigue = values({"kind": "fatigue", "first": "2 N/m", "last": "1 N/m", "start": "5 s", "time_constant": "10 s"})
    assert np.all(fatigue[:5_000] == 2.0)
    assert fatigue[15_000] == pytest.approx(1.0 + math.exp(-1.0))
    assert fatigue[35_000] == pytest.approx(1.0 + math.exp(-3.0))


def test_sinusoid_has_its_mean_amplitude_and_frequency() -> None:
    wave = values({"kind": "sinusoid", "mean": "10 N/m", "amplitude": "3 N/m", "frequency": "0.25 Hz"})
    assert wave[[0, 1000, 2000, 3000]] == pytest.approx([10.0, 13.0, 10.0, 7.0])
    shifted = {"kind": "sinusoid", "mean": "10 N/m", "amplitude": "3 N/m", "frequency": "0.25 Hz", "phase": "180 deg"}
    assert values(shifted)[[0, 1000, 2000, 3000]] == pytest.approx([10.0, 7.0, 10.0, 13.0])


def test_sinusoid_of_random_phase_begins_anywhere() -> None:
    wave = {"kind": "sinusoid", "mean": "10 N/m", "amplitude": "3 N/m", "frequency": "0.25 Hz", "phase": "random"}
    waves = np.stack([values(wave, seed) for seed in range(200)]) - 10.0
    assert np.hypot(waves[:, 0], waves[:, 1000]) == pytest.approx(3.0)
    turns = np.arctan2(waves[:, 0], waves[:, 1000]) / (2.0 * math.pi) + 0.5
    assert np.histogram(turns, 4, (0.0, 1.0))[0] == pytest.approx(50, abs=20)


def test_noise_has_its_mean_and_exactly_its_rms_in_its_band_and_its_window() -> None:
    noise = {"kind": "noise", "mean": "10 N/m", "rms": "2 N/m", "low": "0.05 Hz", "high": "0.5 Hz", "start": "8 s"}
    path = values(noise)
    assert np.all(path[:8000] == 10.0)
    moving = path[8000:] - 10.0
    assert math.sqrt(np.mean(moving**2)) == pytest.approx(2.0, rel=1e-12)
    frequency, power = np.fft.rfftfreq(len(moving), 1e-3), np.abs(np.fft.rfft(moving)) ** 2
    assert power[(frequency < 0.049) | (frequency > 0.501)].sum() < 1e-20 * power.sum()
    assert not np.allclose(path, values(noise, seed=1))
    assert trajectory(noise).changes() == ()


def test_moves_are_straight_of_every_size_and_stay_near() -> None:
    """Each 8 s, within a second."""
    moves = {"kind": "moves", "first": "10 N/m", "greatest": "3 N/m", "every": "8 s", "duration": "1 s"}
    moved = np.stack([values(moves, seed) for seed in range(20)], axis=1) - 10.0
    places = moved[[0, *range(9000, 40_000, 8000)]]
    np.testing.assert_allclose(moved[8000::8000], places[:-1], atol=1e-9)
    np.testing.assert_allclose(moved[8500::8000], 0.5 * (places[1:] + places[:-1]), atol=1e-9)
    sizes = np.abs(np.diff(places, axis=0))
    assert 2.5 < sizes.max() <= 3.0
    assert np.mean(sizes) == pytest.approx(1.5, rel=0.2)
    assert 2.0 < np.abs(places).max() <= 3.0
    assert trajectory(moves).changes() == ()


def test_random_walk_has_its_rate_and_stays_between_its_limits() -> None:
    walk = {
        "kind": "random_walk",
        "first": "100 N/m",
        "rate": "10 %/sqrt(s)",
        "least": "1 N/m",
        "greatest": "10000 N/m",
    }
    path = np.log(values(walk))
    assert path[0] == pytest.approx(math.log(100.0))
    assert np.std(np.diff(path)) == pytest.approx(0.1 * math.sqrt(1e-3), rel=0.02)
    ends = [np.log(values(walk, seed)[-1] / 100.0) for seed in range(200)]
    assert np.std(ends) == pytest.approx(0.1 * math.sqrt(40.0), rel=0.15)
    narrow = values(walk | {"least": "90 N/m", "greatest": "110 N/m"})
    assert 90.0 <= narrow.min() < 91.0
    assert 109.0 < narrow.max() <= 110.0


def test_sequence_takes_one_part_after_the_other_and_knows_its_jumps() -> None:
    falling = {"kind": "ramp", "first": "2 N/m", "last": "1 N/m", "start": "0 s", "duration": "10 s"}
    stepping = {"kind": "steps", "first": "5 N/m", "at": ["4 s", "30 s"], "to": ["6 N/m", "7 N/m"]}
    sequence = {"kind": "sequence", "at": ["10 s"], "parts": [falling, stepping]}
    at = values(sequence)[[0, 5_000, 9_999, 10_000, 29_999, 30_000]]
    assert at == pytest.approx([2.0, 1.5, 1.0001, 6.0, 6.0, 7.0])
    assert trajectory(sequence).changes() == (10.0, 30.0)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("3 kg", "pilot.k_p: '3 kg' has unit 'kg'; allowed: N/m, N/mm"),
        ({"kind": "steps", "first": "1 N/m", "at": ["2 s"], "to": ["1 N/m", "2 N/m"]}, "1 times in 'at' but 2 values"),
        ({"kind": "steps", "first": "1 N/m", "at": ["2 s", "2 s"], "to": ["1 N/m", "2 N/m"]}, "do not rise"),
        ({"kind": "sequence", "at": ["2 s"], "parts": ["1 N/m"]}, "1 parts need 0 times"),
        (
            {"kind": "random_walk", "first": "1 N/m", "rate": "1 %/sqrt(s)", "least": "2 N/m", "greatest": "3 N/m"},
            "least <= first",
        ),
        (
            {"kind": "noise", "mean": "1 N/m", "rms": "1 N/m", "low": "2 Hz", "high": "1 Hz"},
            "low 2 Hz is not below high 1 Hz",
        ),
        (
            {"kind": "moves", "first": "1 N/m", "greatest": "1 N/m", "every": "2 s", "duration": "3 s"},
            "duration 3 s is longer than every 2 s",
        ),
        ({"kind": "wobble"}, "one of steps, ramp, fatigue, sinusoid, noise, moves, random_walk, sequence"),
    ],
)
def test_nonsense_is_refused_with_place_and_remedy(value: Any, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        trajectory(value)
