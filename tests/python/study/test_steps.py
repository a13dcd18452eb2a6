"""Steps of the grip: the truth against the plant, signals against the oracle's detrending, draws as promised."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import settings_table
from lever_cdkf.models.detrend import Detrend
from lever_cdkf.models.lever import Lever
from lever_sil.plants import lever_plant
from lever_sil.plants.truth import Conditions
from lever_sil.study.data import Batch
from lever_sil.study.steps import Step, follow, stepped, substeps_of
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[Any]  # of floats
DEFAULTS = {row.name: row.default for row in settings_table()}
PERIOD = DEFAULTS["sample_period"]
SHORT = Step(at=1.2, duration=2.0)


@pytest.fixture(scope="module")
def batch() -> Batch:
    return stepped(SHORT, 3, 5)


def truth_of(batch: Batch) -> Array:
    assert batch.truth.p is not None
    return batch.truth.p


def test_truth_moves_as_the_plant_does(batch: Batch) -> None:
    """Without process noise and dither, which the plant takes otherwise; both have second-order substeps."""
    p, run = truth_of(batch), 1
    shaken = batch.raw_u * np.array((1.0, 0.0))
    lever = Lever.from_settings(DEFAULTS, "trim")
    x = follow(lever, p, shaken, SHORT.trim, np.zeros((batch.runs, batch.samples - 1, 2)), PERIOD)[run]
    columns = (p[run, :, 0], p[run, :, 1], p[run, :, 2], np.full(batch.samples, SHORT.trim))
    truth, base = lever_plant.Truth(*columns), shaken[run, :, 0]
    conditions = Conditions(base, PERIOD, 0.0, 0.0, np.random.default_rng(1))
    body = lever_plant.LeverPlant(lever_plant.Lever.from_settings(DEFAULTS), truth, "trim", conditions)
    expected = np.empty_like(x)
    for k in range(batch.samples):
        expected[k] = body.theta, body.theta_dot
        if k < batch.samples - 1:
            body.advance(0.0)
    moved = np.ptp(expected, axis=0)
    assert moved[0] > 0.01
    np.testing.assert_allclose(x / moved, expected / moved, rtol=0, atol=5e-5)
    dynamics = lever_plant.dynamics(lever_plant.Lever.from_settings(DEFAULTS), truth, "trim")
    np.testing.assert_allclose(batch.truth.dynamics[run, :, 0], dynamics.natural_frequency, rtol=1e-12)
    np.testing.assert_allclose(batch.truth.dynamics[run, :, 1], dynamics.damping_ratio, rtol=1e-12)


@pytest.mark.parametrize(("period", "count"), [(3e-4, 1), (5e-4, 1), (6e-4, 2), (1e-3, 2), (1.1e-3, 3), (2e-3, 4)])
def test_substeps_are_as_few_as_may_be(period: float, count: int) -> None:
    assert substeps_of(period) == count
    assert substeps_of(period * (1.0 + 1e-9)) == count, "but for rounding"


def test_process_noise_is_that_of_the_step() -> None:
    """A lever without springs and damping integrates it: variance q² t of theta_dot, the same for every substep."""
    free = dataclasses.replace(Lever.from_settings(DEFAULTS, "trim"), stiffness=0.0, damping=0.0)
    runs, samples, q = 400, 200, 0.3
    for substeps in (1, 4):
        kick = q * np.sqrt(PERIOD / substeps)
        kicks = kick * np.random.default_rng(2).standard_normal((runs, samples - 1, substeps))
        nothing = np.tile((2.5, 0.0, 0.0), (runs, samples, 1))
        x = follow(free, nothing, np.zeros((runs, samples, 2)), 0.3, kicks, PERIOD)
        np.testing.assert_allclose(x[:, -1, 1], kicks.sum(axis=(1, 2)), rtol=0, atol=1e-9)
        low, high = chi2.ppf((5e-4, 1.0 - 5e-4), runs)
        assert low < np.sum(np.square(x[:, -1, 1])) / (q**2 * (samples - 1) * PERIOD) < high


def test_signals_are_detrended_as_the_oracle_does(batch: Batch) -> None:
    run, corner = 2, DEFAULTS["trim_corner"]
    align = round(DEFAULTS["align_time"] / PERIOD)
    raw = np.concatenate((batch.raw_y[run], batch.raw_u[run]), axis=1)
    mine = np.concatenate((batch.y[run], batch.u[run]), axis=1)
    for column in range(4):
        detrend = Detrend(float(raw[:align, 0].mean()) if column == 0 else 0.0)
        levels, expected = [], []
        for value in raw[:, column].tolist():
            levels.append(detrend.level)
            expected.append(detrend.step(value, corner, PERIOD))
        np.testing.assert_allclose(mine[:, column], expected, rtol=0, atol=1e-12)
        if column == 0:
            np.testing.assert_allclose(batch.trim[run], levels, rtol=0, atol=1e-12)
