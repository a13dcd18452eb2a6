"""What is kept of a long trace: extremes, bits, ends; and that the pieces it comes in make no difference."""

from __future__ import annotations

import itertools
from typing import cast

import numpy as np
import pytest
from lever_cdkf.replay.recorded_run import Kept, RecordedRun
from lever_cdkf.replay.reduction import Ends, Groups, Stretches
from lever_cdkf.report.bode import slow_trim
from lever_cdkf.report.series import Welch, welch
from lever_cdkf.results.summary import ReplaySummary

Trace = dict[str, np.ndarray]


def trace(count: int) -> Trace:
    random = np.random.default_rng(2)
    theta = random.normal(size=count)
    theta[random.random(count) < 0.1] = np.nan
    return {
        "time_s": np.arange(count) / 1000,
        "theta_measured_rad": theta,
        "k_p_estimate_N_m": np.repeat(random.normal(size=-(-count // 10)), 10)[:count],
        "faults": random.choice([0.0, 1.0, 16.0, np.nan], count),
        "mode": np.sort(random.integers(1, 4, count)).astype(float),
    }


def pieces(whole: Trace, cuts: list[int]) -> list[Trace]:
    edges = [0, *cuts, len(whole["time_s"])]
    return [{name: values[a:b] for name, values in whole.items()} for a, b in itertools.pairwise(edges)]


def reduced(parts: list[Trace], most: int = 64) -> Stretches:
    stretches = Stretches(most)
    for part in parts:
        stretches.add(part)
    return stretches


@pytest.mark.parametrize("count", [1, 10, 63, 64, 65, 1000, 4096, 5001])
def test_pieces_make_no_difference(count: int) -> None:
    whole = trace(count)
    at_once = reduced([whole])
    in_pieces = reduced(pieces(whole, sorted({count // 3, count // 2, count - 1} - {0})))
    assert at_once.size == in_pieces.size
    once, cut = at_once.rows(), in_pieces.rows()
    for name in whole:
        np.testing.assert_array_equal(once[name], cut[name], name)
    assert len(once["time_s"]) <= 2 * 65


@pytest.mark.parametrize("count", [1000, 5001])
def test_a_stretch_keeps_what_was_in_it(count: int) -> None:
    whole = trace(count)
    stretches = reduced([whole])
    size, rows = stretches.size, stretches.rows()
    assert size == {1000: 16, 5001: 128}[count]
    for index in range(-(-count // size)):
        inside = slice(index * size, (index + 1) * size)
        theta = whole["theta_measured_rad"][inside]
        assert rows["theta_measured_rad"][2 * index] == np.nanmin(theta)
        assert rows["theta_measured_rad"][2 * index + 1] == np.nanmax(theta)
        assert rows["time_s"][2 * index] == whole["time_s"][inside][0]
        assert rows["k_p_estimate_N_m"][2 * index] == whole["k_p_estimate_N_m"][inside][0]
        bits = np.bitwise_or.reduce(np.nan_to_num(whole["faults"][inside]).astype(int))
        assert rows["faults"][2 * index] == rows["faults"][2 * index + 1] == bits
    assert (np.diff(rows["time_s"]) >= 0.0).all()


def test_groups_are_of_equal_size_wherever_the_cuts_are() -> None:
    values = np.arange(103.0)
    groups = Groups(10, lambda column: (column.reshape(-1, 10).sum(axis=1),))
    for part in np.array_split(values, 7):
        groups.add(part)
    gathered = groups.all()
    assert gathered is not None
    np.testing.assert_array_equal(gathered[0], values[:100].reshape(-1, 10).sum(axis=1))
    assert Groups(10, lambda column: (column,)).all() is None


def test_ends_are_every_sample_of_them() -> None:
    whole = trace(5000)
    ends = Ends(0.5)
    for part in pieces(whole, [100, 2000, 2001, 4800]):
        ends.add(part)
    for start, which in ((0.0, slice(0, 501)), (4.499, slice(4499, 5000))):
        near = ends.near(start)
        for name, values in whole.items():
            np.testing.assert_array_equal(near[name], values[which], name)


def test_a_spectrum_in_pieces_is_that_of_the_whole() -> None:
    values = np.random.default_rng(3).normal(size=10_000)
    averaged = Welch(1e-3)
    for part in np.array_split(values, 9):
        averaged.add(part)
    for piecewise, whole in zip(averaged.spectrum(), welch(values, 1e-3), strict=True):
        np.testing.assert_allclose(piecewise, whole, rtol=1e-12)


@pytest.mark.parametrize("there", ["estimate", "measured", "estimate measured"])
def test_the_trim_is_that_of_the_estimate_where_there_is_one(there: str) -> None:
    time = np.linspace(0.0, 20.0, 2000)
    angles = {"estimate": 0.3 + 0.1 * np.sin(0.5 * time), "measured": 0.4 + 0.1 * np.sin(0.7 * time)}
    kept = Kept(0.01)
    kept.stretches.add({"time_s": time, **{f"theta_{name}_rad": angles[name] for name in there.split()}})
    run = RecordedRun(kept, cast(ReplaySummary, None))
    expected = slow_trim(time, angles[there.split()[0]], run.settings["trim_corner"])
    np.testing.assert_array_equal(run.followed_trim, expected)
