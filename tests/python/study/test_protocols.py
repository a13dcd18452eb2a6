"""The protocols of others: what the parameters do, and the figures of their tables on errors that are known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from accuracy import protocols
from accuracy.protocols import SQUARE_WAVE, accounted, remnants, square_wave
from lever_sil.study.compare.cases import SQUARE, Plan, Protocol, cases
from lever_sil.study.compare.entrants import entrants
from lever_sil.study.compare.run_cases import Outcome, Results

PLAN = Plan(seeds=3, duration=4.0)
"""A tenth of the case's own duration: the halves of the square wave are 0.5 s."""


def case(name: str) -> Protocol:
    found = cases()[name]
    assert isinstance(found, Protocol)
    return found


def factors(name: str) -> np.ndarray:
    batch = case(name).batch(PLAN)
    assert batch.truth.p is not None
    found: np.ndarray = batch.truth.p / batch.truth.p[:, :1]
    return found


def test_parameters_stay_rise_slowly_jump_or_alternate() -> None:
    time = np.arange(4000) * 1e-3
    assert np.ptp(factors("remnant_constant_0.05"), axis=1).max() < 1e-12
    rise = 1.0 + 0.3 * np.clip((time - 1.0) / 2.0, 0.0, 1.0)
    slow = factors("remnant_slow_0.05")
    np.testing.assert_allclose(slow, np.broadcast_to(np.column_stack((np.ones(4000), rise, rise)), slow.shape))
    jump = factors("remnant_jump_0.05")
    np.testing.assert_allclose(jump[:, [1999, 2000], 2], [[1.0, 1.3]] * 3)
    square = factors(SQUARE_WAVE)
    np.testing.assert_allclose(square[..., :2], 1.0)
    at = [999, 1000, 1499, 1500, 1999, 2000, 3499, 3500]
    np.testing.assert_allclose(square[0, at, 2], [1.0, SQUARE, SQUARE, 1.0, 1.0, SQUARE, SQUARE, 1.0])


def test_the_remnant_is_told_to_baselines_and_not_to_the_firmware() -> None:
    for remnant in (0.02, 0.2):
        own = case(f"remnant_jump_{remnant:g}")
        assert own.batch(Plan(seeds=1, duration=1.0)).knowledge.process_noise == remnant
        made: Any = entrants(own)["dual_shipped"].make(own)
        assert "theta_dot_process_noise" not in made.settings
        assert {"joint_ekf", "rls", "rls_regularised", "lms"} <= entrants(own).keys()


def outcome(name: str, relative: np.ndarray) -> Results:
    """Results with these errors (B, T, 5), each 50 ms, as of an estimator named `made`."""
    time = 0.05 * np.arange(1, relative.shape[1] + 1)
    errors = relative.copy()
    errors[..., :3] = np.log1p(relative[..., :3])
    plan = replace(PLAN, seeds=len(relative), duration=None)
    return Results(plan, {(name, "made"): Outcome(time, errors, relative, None, None, None, 0.0, 1)}, {})


def test_rms_scatter_and_time_to_follow() -> None:
    """Errors of ±2 % in two runs, and 10 % for 1 s after the jump."""
    relative = np.zeros((2, 799, 5))
    relative[0, :, 3], relative[1, :, 3] = 0.02, -0.02
    relative[:, 399:419, 3] = 0.10
    (row,) = remnants(outcome("remnant_jump_0.05", relative))
    assert row["f_n: rms [%]"] == "2.0 / 2.0"
    assert row["f_n: sd over runs [%]"] == "2.8"
    assert row["f_n to 5 % [s]"] == "1.0 / 1.0"


def test_bias_and_random_error_add_up_and_a_lag_is_a_rise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an estimate that follows the square wave with a lag of first order, 0.8 s, and scatters by 3 %."""
    monkeypatch.setattr(protocols, "accounted", lambda *_: np.ones(1))
    time = 0.05 * np.arange(1, 800)
    high = case(SQUARE_WAVE).high(time, Plan())
    estimate, now = np.ones(799), 1.0
    for k, level in enumerate(np.where(high, SQUARE, 1.0)):
        now += (1.0 - np.exp(-0.05 / 0.8)) * (level - now)
        estimate[k] = now
    relative = np.zeros((40, 799, 5))
    relative[..., 2] = estimate / np.where(high, SQUARE, 1.0) - 1.0
    relative[..., 2] += 0.03 * np.random.default_rng(1).standard_normal((40, 799))
    monkeypatch.setattr(Protocol, "batch", lambda *_: None)
    row, _ = square_wave(outcome(SQUARE_WAVE, relative))
    bias, scatter, total = (float(str(row[f"{name} error [%]" if name != "bias" else "bias [%]"])) for name in
                            ("bias", "random", "total"))  # fmt: skip
    assert total == pytest.approx(np.hypot(bias, scatter), rel=0.05)
    assert scatter == pytest.approx(3.0, abs=0.15)
    assert float(str(row["rise [s]"])) == pytest.approx(0.8, abs=0.11)


def test_the_true_parameters_account_for_nearly_all_that_no_noise_moves() -> None:
    own = replace(case(SQUARE_WAVE), process_noise=1e-6)
    batch = own.batch(PLAN)
    time = 0.05 * np.arange(1, 80)
    errors = np.zeros((3, 79, 5))
    judged = time >= 1.0
    exact = accounted(batch, Outcome(time, errors, errors, None, None, None, 0.0, 1), judged)
    assert (exact > 95.0).all(), "but for what the high-pass makes of the start"
    wrong = np.zeros_like(errors)
    wrong[..., 2] = 0.3
    assert (accounted(batch, Outcome(time, wrong, wrong, None, None, None, 0.0, 1), judged) < exact - 5.0).all()
