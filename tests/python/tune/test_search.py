"""What is found in logs of which the truth is known, and what is said where a log does not tell."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from lever_cdkf.tune import recording, validation
from lever_cdkf.tune.likelihood import Likelihood
from lever_cdkf.tune.search import Search, Tuned, change_walk, groups
from python.tune.conftest import NOISE, WALK, Simulate


def found_in(likelihood: Likelihood, *kept: str, **settings: float | str) -> dict[str, Tuned]:
    return {entry.name: entry for entry in Search(likelihood, settings).run(groups(settings, kept))}


@pytest.mark.parametrize("wrong", [1.0, 8.0])
def test_noise_is_found_wherever_the_search_starts(steady_log: Path, wrong: float) -> None:
    """Measurement noise within 2 %; process noise, of which the trim filter takes some, within 12 %."""
    likelihood = Likelihood(recording.read([steady_log]))
    start = {"theta_noise": 1e-3 * wrong, "theta_dot_noise": 1e-2 / wrong, "theta_dot_process_noise": 0.05 * wrong}
    walks = ("m_p_walk", "c_p_walk", "k_p_walk", "walk_ceiling", "robbins_monro_time")
    found = found_in(likelihood, *walks, **start)
    assert list(found) == list(NOISE)
    for name, share in zip(NOISE, (0.02, 0.02, 0.12), strict=True):
        assert found[name].after == pytest.approx(NOISE[name], rel=share), name
        assert found[name].low is not None
        assert found[name].high is not None


def test_the_walk_of_the_parameters_is_found(simulate: Simulate) -> None:
    likelihood = Likelihood(recording.read([simulate(80.0, changing=True)]), held_out=0.0)
    found = found_in(likelihood, *NOISE, "m_p_walk", adaptation="fixed", **NOISE)
    for name, true in WALK.items():
        low, high = found[name].low, found[name].high
        assert low is not None, name
        assert high is not None, name
        assert low < true < high, name
        assert found[name].verdict == "too small"


def test_what_does_not_change_gets_the_greatest_walk_that_is_not_contradicted(steady_log: Path) -> None:
    likelihood = Likelihood(recording.read([steady_log]))
    found = found_in(likelihood, *NOISE, "m_p_walk", "c_p_walk", adaptation="fixed", k_p_walk=0.2, **NOISE)
    stiffness = found["k_p_walk"]
    assert stiffness.low is None
    assert stiffness.best < stiffness.after < 0.03
    assert stiffness.after == stiffness.high


def test_part_that_is_not_tuned_on_shows_the_improvement(steady_log: Path) -> None:
    likelihood = Likelihood(recording.read([steady_log]))
    assert not (likelihood.tuned_on & likelihood.judged_by).any()
    fits = validation.fits(likelihood, {}, NOISE)
    parts = {(before.noise, before.part): (before, after) for before, after in validation.pairs(fits)}
    before, after = parts["as set", "held out"]
    gained = validation.gain(before, after)
    assert gained.is_better
    assert gained.mean > 0.5
    assert not validation.is_worse(fits)
    assert after.nis == pytest.approx(1.02, abs=0.03)  # 0.02: the trim filter's; of 8000 samples 0.011 is chance
    assert before.nis > 1.5
    assert "better with noise as set" in validation.verdict(fits, 3)


def test_settings_that_only_fit_the_part_tuned_on_are_no_gain(steady_log: Path) -> None:
    """The angle's noise is four times as large in the part held out: the log is not of one kind."""
    whole = recording.read([steady_log])
    late = whole.time > 0.8 * whole.duration
    more = np.random.default_rng(1).standard_normal(late.sum()) * NOISE["theta_noise"] * 4.0
    samples = whole.samples.copy()
    samples["theta"][late] += more.astype(np.float32)
    likelihood = Likelihood(dataclasses.replace(whole, samples=samples))
    before = {**NOISE, "theta_noise": 1e-3, "noise_window": 0.0}
    others = ("theta_dot_noise", "theta_dot_process_noise", "walk_ceiling", "robbins_monro_time")
    found = found_in(likelihood, *others, "m_p_walk", "c_p_walk", "k_p_walk", **before)
    assert found["theta_noise"].after == pytest.approx(NOISE["theta_noise"], rel=0.02)
    fits = validation.fits(likelihood, before, {**before, "theta_noise": found["theta_noise"].after})
    assert validation.is_worse(fits)
    assert "worse" in validation.verdict(fits, 1)


def test_at_rest_only_noise_is_looked_for(simulate: Simulate) -> None:
    at_rest = simulate(25.0, rest=True, theta_dot_process_noise=0.0)
    steps: list[tuple[int, int, str]] = []
    recorded = recording.read([at_rest], progress=lambda *step: steps.append(step))
    assert steps[-1] == (at_rest.stat().st_size, at_rest.stat().st_size, "reading the log")
    steps.clear()
    likelihood = Likelihood(recorded)
    likelihood.progress = lambda *step: steps.append(step)
    search = Search(likelihood, {})
    assert not search.can_learn
    assert [entry.name for entry in search.run(groups({}, list(NOISE)[1:]))] == ["theta_noise"]
    done = [step[0] for step in steps]
    assert done == sorted(done)
    assert all(0 < so_far < total for so_far, total, _ in steps)
    assert list(dict.fromkeys(step[2] for step in steps)) == ["looking for noise", "how sure that is"]


def test_what_is_off_or_kept_is_not_looked_for() -> None:
    wanted = groups({"theta_dot_process_noise": 0.0, "adaptation": "fixed", "model": "linear_black_box"}, ["a22_walk"])
    assert wanted == {"noise": ("theta_noise", "theta_dot_noise"), "walk": ("a21_walk", "b21_walk")}


@pytest.mark.parametrize(
    ("mean", "outcome"),
    [(2.9, "no clear difference"), (3.1, "better"), (-1.9, "no clear difference"), (-2.1, "worse"), (-0.0115, "worse")],
)
def test_a_gain_is_clear_beyond_three_standard_errors_and_a_loss_beyond_two(mean: float, outcome: str) -> None:
    gain = validation.Gain(mean, 0.0047 if abs(mean) < 1.0 else 1.0)
    assert validation._outcome(gain) == outcome


@pytest.mark.parametrize(
    ("low", "high", "after", "verdict"),
    [
        (0.5, 2.0, 1.0, "kept: not contradicted"),
        (None, None, 1.0, "kept: the log does not determine it"),
        (None, 2.0, 1.0, "kept: not contradicted"),
        (1.5, 4.0, 3.0, "too small"),
        (1.5, None, 3.0, "too small"),
        (0.1, 0.4, 3.0, "too small"),
        (None, 0.8, 0.8, "too large: the greatest not contradicted"),
    ],
)
def test_decision(low: float | None, high: float | None, after: float, verdict: str) -> None:
    found = Tuned("theta_noise", before=1.0, best=3.0, low=low, high=high)
    assert (found.after, found.verdict) == (after, verdict)


@pytest.mark.parametrize(
    ("walks", "expected"),
    [
        ({"m_p_walk": 0.0075, "c_p_walk": 0.02}, {}),
        ({"m_p_walk": 0.015, "c_p_walk": 0.04}, {}),
        ({"m_p_walk": 0.0075, "c_p_walk": 0.01}, {"change_walk": 200.0}),
        ({"m_p_walk": 0.0025, "c_p_walk": 0.01}, {"change_walk": 450.0}),
        ({"k_p_walk": 1e-4}, {"change_walk": 10000.0}),
    ],
)
def test_with_smaller_walks_a_change_counts_as_more_of_them(
    walks: dict[str, float], expected: dict[str, float]
) -> None:
    """50 s by default: half the walk takes four times as long for the same. The setting ends at 10000 s."""
    usual = {"m_p_walk": 0.0075, "c_p_walk": 0.02, "k_p_walk": 0.02}
    noise = Tuned("theta_noise", before=1.0, best=0.1, low=0.05, high=0.2)
    tuned = [Tuned(name, usual[name], value, low=value, high=value) for name, value in walks.items()]
    assert change_walk({}, [noise, *tuned]) == expected


def test_the_error_of_a_gain_is_the_scatter_of_half_seconds() -> None:
    """Gains that change sign every half a second: means over longer or shorter times scatter by another amount."""
    gains = np.tile(np.repeat([3.0, -1.0], 50), 10)
    before, after = (
        validation.Fit(name, "as set", "held out", np.array(values, [("log_likelihood", "f8")]), 0.01)
        for name, values in (("before", np.zeros(1000)), ("after", gains))
    )
    gained = validation.gain(before, after)
    assert gained.mean == pytest.approx(1.0)
    assert gained.error == pytest.approx(2.0 / math.sqrt(19.0))
