"""The search and the parts of a recording against closed forms: likelihoods that are parabolas, few samples."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.innovations import INNOVATION, SAMPLE
from lever_cdkf.tune import search as searching
from lever_cdkf.tune.calibration import dither
from lever_cdkf.tune.likelihood import Likelihood, noise_as_set
from lever_cdkf.tune.recording import Recording, read
from lever_cdkf.tune.search import Search, Tuned, groups, logarithmic_range
from python.tune.test_commands import write_log

WIDE = 0.5 * 1.959964**2
"""By which the logarithm of a likelihood has fallen at the ends of a 95 % interval."""


class Parabola:
    """The log-likelihood of settings, a parabola in the logarithm of each about its best value."""

    def __init__(self, best: dict[str, tuple[float, float]], learnt: float = 60.0) -> None:
        """`best`: most likely value and standard deviation of its logarithm."""
        self.best, self.seconds = best, learnt
        self.asked: list[dict[str, Any]] = []
        self.told: list[str] = []

    def learnt(self, _: Any) -> float:
        return self.seconds

    def expect(self, doing: str, runs: int | None = None) -> None:
        self.told.append(doing)

    def of(self, assignments: dict[str, Any]) -> float:
        self.asked.append(assignments)
        return 1000.0 - sum(
            0.5 * (math.log(assignments[name] / value) / sigma) ** 2 for name, (value, sigma) in self.best.items()
        )


def looked_for(likelihood: Parabola, names: dict[str, tuple[str, ...]], **start: float) -> list[Tuned]:
    return Search(cast(Likelihood, likelihood), start).run(names)


def test_most_likely_values_and_their_intervals() -> None:
    best = {"theta_noise": (0.5e-3, 0.05), "m_p_walk": (0.02, 0.2)}
    likelihood = Parabola(best)
    found = looked_for(likelihood, {"noise": ("theta_noise",), "walk": ("m_p_walk",)})
    assert [each.name for each in found] == list(best)
    for each in found:
        value, sigma = best[each.name]
        assert each.before == setting(each.name).default
        assert each.best == pytest.approx(value, rel=0.15 * sigma + 0.01)
        assert each.low is not None
        assert each.high is not None
        assert math.log(each.low / value) == pytest.approx(-1.96 * sigma, abs=0.02)
        assert math.log(each.high / value) == pytest.approx(1.96 * sigma, abs=0.02)
    assert all(asked["noise_window"] == 0.0 for asked in likelihood.asked)
    assert list(dict.fromkeys(likelihood.told)) == ["", "looking for noise", "looking for walk", "how sure that is"]
    assert likelihood.told.count("looking for noise") == 2  # once more, with the walk as found


def test_what_the_log_does_not_tell_has_no_end() -> None:
    flat = Parabola({"theta_noise": (1e-3, 1e6)})
    (found,) = looked_for(flat, {"noise": ("theta_noise",)})
    assert (found.low, found.high) == (None, None)
    assert found.verdict == "kept: the log does not determine it"
    assert found.after == found.before


def test_a_best_value_beyond_the_range_is_at_its_end() -> None:
    row = setting("theta_noise")
    (found,) = looked_for(Parabola({"theta_noise": (10.0 * row.greatest, 0.5)}), {"noise": ("theta_noise",)})
    assert found.best == pytest.approx(row.greatest, rel=0.01)
    assert found.high is None


def test_a_range_is_a_thousandfold_within_that_of_the_setting() -> None:
    row = setting("theta_noise")
    low, high = map(math.exp, logarithmic_range("theta_noise", row.default))
    assert low == pytest.approx(max(row.least, row.default / 1000.0))
    assert high == pytest.approx(min(row.greatest, row.default * 1000.0))


@pytest.mark.parametrize("seconds", [4.9, 5.0])
def test_walks_are_looked_for_only_where_parameters_learn(seconds: float) -> None:
    likelihood = Parabola({"theta_noise": (1e-3, 0.1), "m_p_walk": (0.02, 0.2)}, seconds)
    if seconds < 5.0:
        likelihood.best.pop("m_p_walk")
    found = looked_for(likelihood, {"noise": ("theta_noise",), "walk": ("m_p_walk",)})
    assert [each.name for each in found] == ["theta_noise", *(["m_p_walk"] if seconds >= 5.0 else [])]


def test_settings_that_break_the_filter_are_avoided(monkeypatch: pytest.MonkeyPatch) -> None:
    likelihood = Parabola({"theta_noise": (0.5e-3, 0.05)})
    whole = likelihood.of
    monkeypatch.setattr(likelihood, "of", lambda a: -math.inf if a["theta_noise"] > 3e-3 else whole(a))
    (found,) = looked_for(likelihood, {"noise": ("theta_noise",)})
    assert found.best == pytest.approx(0.5e-3, rel=0.02)


@pytest.mark.parametrize(
    ("adaptation", "wanted"),
    [
        ("fixed", ()),
        ("annealing", ("walk_ceiling", "annealing_time")),
        ("robbins_monro", ("walk_ceiling", "robbins_monro_time")),
        ("forgetting", ("forgetting_time",)),
    ],
)
def test_settings_of_each_adaptation(adaptation: str, wanted: tuple[str, ...]) -> None:
    found = groups({"adaptation": adaptation})
    assert found.get("adaptation", ()) == wanted
    assert found["noise"] == ("theta_noise", "theta_dot_noise", "theta_dot_process_noise")
    assert found["walk"] == ("m_p_walk", "c_p_walk", "k_p_walk")
    assert noise_as_set({"a": 1.0}) == {"a": 1.0, "noise_window": 0.0}
    assert found["noise"] == searching.NOISE


# --- parts of a recording --------------------------------------------------------------------------------------------


def recording(seconds: float, period: float = 0.01) -> Recording:
    samples = np.zeros(round(seconds / period), SAMPLE)
    samples["time_us"] = np.arange(len(samples)) * round(1e6 * period)
    return Recording(samples, period, "can0", {}, cast(Any, None))


@pytest.mark.parametrize(("seconds", "begin"), [(100.0, 10.0), (30.0, 6.0)])
def test_the_start_counts_for_nothing_and_the_end_is_held_out(seconds: float, begin: float) -> None:
    """Ten seconds, or a fifth where there is less."""
    likelihood = Likelihood(recording(seconds), held_out=0.25)
    time = likelihood.recording.time
    tuned, judged = time[likelihood.tuned_on], time[likelihood.judged_by]
    split = begin + 0.75 * (seconds - begin)
    assert (tuned[0], tuned[-1]) == pytest.approx((begin, split), abs=0.011)
    assert (judged[0], judged[-1]) == pytest.approx((split, seconds), abs=0.011)
    assert likelihood.recording.duration == pytest.approx(seconds - 0.01)


def test_what_is_too_short() -> None:
    Likelihood(recording(20.0))
    with pytest.raises(LeverError, match=r"^too short to tune on: 19\.9 s of samples; at least 20 s are needed$"):
        Likelihood(recording(19.9))
    with pytest.raises(LeverError, match=r"^too short to tune on: 19\.999 s of samples; at least 20 s are needed$"):
        Likelihood(recording(19.9995, 0.0005))


def changed(likelihood: Likelihood, monkeypatch: pytest.MonkeyPatch, *spans: tuple[float, float]) -> bool:
    """Return whether other parts are tuned on where the estimator reports changes in these spans [s]."""
    time = likelihood.recording.time
    result = np.zeros(len(time), INNOVATION)
    for begin, end in spans:
        result["changed"] |= (time >= begin - 1e-9) & (time < end - 1e-9)
    monkeypatch.setattr(likelihood, "run", lambda *_: result)
    return likelihood.leave_out_changes({})


def test_changes_are_left_out_with_what_is_beside_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second before, and three after."""
    likelihood = Likelihood(recording(100.0), held_out=0.0)
    assert not changed(likelihood, monkeypatch)
    assert likelihood.changes == []
    assert likelihood.longest_calm() == pytest.approx((0.0, 99.99))
    assert changed(likelihood, monkeypatch, (40.0, 42.0))
    assert likelihood.changes[0] == pytest.approx((40.0, 42.0))
    assert len(likelihood.changes) == 1
    left_out = likelihood.recording.time[~likelihood.tuned_on]
    left_out = left_out[left_out > 11.0]
    assert (left_out[0], left_out[-1]) == pytest.approx((39.0, 45.0), abs=0.011)
    assert likelihood.longest_calm() == pytest.approx((45.0, 99.99 - 45.0))
    assert not changed(likelihood, monkeypatch, (40.0, 42.0))
    assert changed(likelihood, monkeypatch, (60.0, 61.0))
    assert likelihood.longest_calm() == pytest.approx((0.0, 59.0))


def test_where_most_would_be_left_out_all_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    likelihood = Likelihood(recording(100.0), held_out=0.0)
    assert changed(likelihood, monkeypatch, (20.0, 60.0))  # 44 of 90 s
    assert likelihood.tuned_on.sum() == pytest.approx(4600, abs=2)
    changed(likelihood, monkeypatch, (20.0, 62.0))  # 46
    assert likelihood.tuned_on.sum() == pytest.approx(9000, abs=1)


def test_sums_are_of_the_part_that_is_tuned_on(monkeypatch: pytest.MonkeyPatch) -> None:
    likelihood = Likelihood(recording(100.0), held_out=0.5)
    result = np.zeros(10_000, INNOVATION)
    result["log_likelihood"], result["learns"] = 2.0, True
    result["log_likelihood"][~likelihood.tuned_on] = 99.0
    monkeypatch.setattr(likelihood, "run", lambda *_: result)
    assert likelihood.of({}) == pytest.approx(2.0 * 4500, abs=4.0)
    assert likelihood.learnt({}) == pytest.approx(45.0, abs=0.02)
    result["log_likelihood"][2000] = np.nan
    assert likelihood.of({}) == -math.inf


@pytest.mark.parametrize(("hertz", "passes"), [(0.1, 0.02), (5.0, 1.0)])
def test_dither_is_the_torque_above_a_hertz(hertz: float, passes: float) -> None:
    recorded = recording(100.0)
    recorded.samples["tau_m"] = math.sqrt(2.0) * np.sin(2.0 * math.pi * hertz * recorded.time)
    recorded.samples["tau_m_valid"] = True
    assert dither(Likelihood(recorded)) == pytest.approx(passes, rel=0.02, abs=0.02)
    recorded.samples["tau_m_valid"] = False
    assert dither(Likelihood(recorded)) == 0.0


def test_time_goes_on_where_it_wraps_or_starts_anew() -> None:
    recorded = recording(1.0)
    recorded.samples["time_us"] = (np.arange(100) * 10_000 + 2**32 - 500_000) % 2**32
    assert recorded.time == pytest.approx(np.arange(100) * 0.01)
    recorded.samples["time_us"][50:] = np.arange(50) * 10_000  # its sender was started anew
    assert recorded.time == pytest.approx(np.arange(100) * 0.01)
    recorded.samples["time_us"] = np.arange(100) * 10_000 + (np.arange(100) >= 50) * 2_000_000  # a gap
    assert recorded.duration == pytest.approx(2.99)


def test_a_delay_of_nothing_changes_nothing() -> None:
    recorded = recording(1.0)
    assert recorded.without_delay(0.0) is recorded.samples
    assert recorded.without_delay(0.1) is recorded.samples  # nothing was measured
    recorded.samples["z_ddot_valid"] = True
    recorded.samples["z_ddot"] = recorded.time
    moved = recorded.without_delay(0.1)
    assert moved["z_ddot"][:80] == pytest.approx(recorded.time[:80] + 0.1, abs=1e-6)
    assert recorded.samples["z_ddot"][0] == 0.0


def test_two_samples_are_a_recording_and_one_is_none(tmp_path: Path) -> None:
    write_log(tmp_path / "two.log", 2)
    two = read([tmp_path / "two.log"])
    assert (len(two.samples), two.period, two.bus) == (2, 1e-3, "can0")
    assert two.duration == pytest.approx(1e-3)
    write_log(tmp_path / "one.log", 1)
    with pytest.raises(LeverError, match=r"one\.log: too few samples to tune on, 1: it holds no more$"):
        read([tmp_path / "one.log"])
