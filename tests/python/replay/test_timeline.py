"""The time of samples: recorder and sender, wraps, restarts, gaps."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.replay.timeline import WRAP, Timeline

START = 1_700_000_000_000_000


def seconds(recorded: np.ndarray, sender: np.ndarray, pieces: int = 1) -> tuple[np.ndarray, Timeline]:
    timeline = Timeline(1e-3)
    parts = zip(np.array_split(recorded, pieces), np.array_split(sender % WRAP, pieces), strict=True)
    return np.concatenate([timeline.seconds(r, s.astype(np.float64)) for r, s in parts]), timeline


def steady(count: int, first_us: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return recorded times with half a millisecond of jitter, and the sender's own."""
    sender = first_us + 1000 * np.arange(count, dtype=np.int64)
    jitter = np.random.default_rng(0).integers(-500, 500, count)
    return START + sender - first_us + jitter, sender


@pytest.mark.parametrize("pieces", [1, 7, 1000])
def test_the_senders_clock_counts_and_not_the_recorders_jitter(pieces: int) -> None:
    time, timeline = seconds(*steady(1000), pieces)
    np.testing.assert_array_equal(time, np.arange(1000) / 1000)
    clocks = timeline.clocks
    assert (clocks.samples, clocks.late, clocks.restarts, clocks.recorder_jumps, clocks.gaps) == (1000, 0, 0, 0, 0)


def test_the_typical_step_is_that_of_most_samples() -> None:
    """Whatever the settings say of the sample period, and in spite of samples that are missing."""
    recorded, sender = steady(1000)
    there = np.arange(1000) % 10 > 2
    assert seconds(2 * recorded[there], 2 * sender[there])[1].typical_step_us == 2000


@pytest.mark.parametrize("rate", [0.5, 0.8, 0.94, 0.97, 1.0, 1.03, 1.1, 1.3, 2.0])
@pytest.mark.parametrize("lost", [0, 10])
def test_a_rate_that_differs_by_some_per_cent_is_told_from_lost_samples(rate: float, lost: int) -> None:
    recorded, sender = steady(1000)
    there = np.arange(1000) % 100 >= lost
    found = seconds((rate * recorded[there]).astype(np.int64), (rate * sender[there]).astype(np.int64))[1]
    assert found.typical_step_us == pytest.approx(
        1000.0 * rate, rel=0.01 if not lost else 0.04 if rate >= 1.0 else 0.11
    )


@pytest.mark.parametrize("steps", [[1.0], [1.4, 0.6], [0.8, 0.8, 0.8, 1.6], [1.3, 0.7, 1.0], [1.6, 0.4]])
def test_steps_that_are_right_in_the_mean_are_no_other_rate(steps: list[float]) -> None:
    sender = np.cumsum(np.tile(1000.0 * np.array(steps), 300)).astype(np.int64)
    assert seconds(START + sender, sender)[1].typical_step_us == pytest.approx(1000.0, abs=1.0)


def test_32_bits_that_wrap_go_on() -> None:
    time, timeline = seconds(*steady(2000, WRAP - 1_000_000), 3)
    np.testing.assert_array_equal(time, np.arange(2000) / 1000)
    assert timeline.clocks.wraps == 1
    assert timeline.clocks.restarts == 0


def test_a_pause_of_two_wraps_is_as_long_as_the_recorder_says() -> None:
    recorded, sender = steady(200)
    pause = 2 * WRAP + 3_000_000
    recorded[100:] += pause
    sender[100:] += pause
    time, timeline = seconds(recorded, sender)
    assert time[100] - time[99] == pytest.approx(pause / 1e6 + 1e-3, abs=1e-9)
    assert timeline.clocks.gaps == 1
    assert timeline.clocks.longest_gap_s == pytest.approx(pause / 1e6 + 1e-3)


def test_a_sender_that_starts_over_goes_on_after_the_recorders_pause() -> None:
    recorded, sender = steady(200, 500_000_000)
    recorded[100:] += 2_000_000
    sender[100:] -= 500_000_000
    time, timeline = seconds(recorded, sender)
    assert time[100] - time[99] == pytest.approx(2.001, abs=2e-3)
    np.testing.assert_allclose(np.diff(time[100:]), 1e-3)
    assert timeline.clocks.restarts == 1


@pytest.mark.parametrize("jump", [-3_600_000_000, -5_000_000, 100_000_000])
def test_a_recorder_whose_clock_is_set_changes_nothing(jump: int) -> None:
    recorded, sender = steady(200)
    recorded[100:] += jump
    time, timeline = seconds(recorded, sender)
    np.testing.assert_array_equal(time, np.arange(200) / 1000)
    assert timeline.clocks.recorder_jumps == 1
    assert timeline.clocks.restarts == 0


@pytest.mark.parametrize(("step", "gaps"), [(1500, 0), (1501, 1)])
def test_a_gap_is_longer_than_a_period_and_a_half(step: int, gaps: int) -> None:
    recorded, sender = steady(100)
    sender[50:] += step - 1000
    recorded[50:] += step - 1000
    _, timeline = seconds(recorded, sender)
    assert timeline.clocks.gaps == gaps
    assert timeline.clocks.longest_gap_s == pytest.approx(gaps * step * 1e-6)


@pytest.mark.parametrize(("jump", "jumps"), [(990_000, 0), (1_010_000, 1)])
def test_clocks_agree_within_a_second(jump: int, jumps: int) -> None:
    recorded, sender = (1000 * np.arange(200, dtype=np.int64) for _ in range(2))
    recorded[100:] += jump
    time, timeline = seconds(recorded, sender)
    np.testing.assert_array_equal(time, np.arange(200) / 1000)
    assert timeline.clocks.recorder_jumps == jumps


def test_missing_and_late_samples_are_counted() -> None:
    recorded, sender = steady(100)
    keep = np.r_[0:40, 45:100]
    recorded, sender = recorded[keep], sender[keep]
    sender[60] = sender[58]
    time, timeline = seconds(recorded, sender)
    assert (np.diff(time) >= 0.0).all()
    assert timeline.clocks.longest_gap_s == pytest.approx(0.006)
    assert timeline.clocks.late == 1
