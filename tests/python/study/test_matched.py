"""Matched batches: reproducible, and with the statistics that they promise (plant, scipy, chi-square bands)."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np
import pytest
from lever_cdkf.errors import SettingsError
from lever_cdkf.firmware.config import settings_table
from lever_sil.plants import lever_plant
from lever_sil.study.data import Batch
from lever_sil.study.matched import Condition, matched
from numpy.typing import NDArray
from scipy import signal
from scipy.stats import chi2, kstest

Array = NDArray[Any]  # of floats
DEFAULTS = {row.name: row.default for row in settings_table()}


def settings_of(names: tuple[str, ...], guess: Array, sigma: Array, walk: Array) -> dict[str, float]:
    columns = (("", guess), ("_sigma", sigma), ("_walk", walk))
    return {f"{name}{ending}": float(row[i]) for ending, row in columns for i, name in enumerate(names)}


PHYSICAL = settings_of(
    ("m", "c", "k"), np.array([2.5, 42.0, 1500.0]), np.array([0.4, 0.6, 0.6]), np.array([0.01, 0.02, 0.02])
)
BLACK_BOX = settings_of(
    ("a21", "a22", "b21"), np.array([-465.0, -13.7, -2.2]), np.array([180.0, 6.0, 0.8]), np.array([9.0, 0.3, 0.03])
)
CONDITIONS = {
    f"{model} {preload}": Condition(model, preload, dither_rms=0.3, settings=settings)
    for model, settings in (("lever", {}), ("linear_physical", PHYSICAL), ("linear_black_box", BLACK_BOX))
    for preload in ("fixed", "trim")
}
every = pytest.mark.parametrize("name", CONDITIONS)


@functools.cache
def drawn(name: str) -> Batch:
    return matched(CONDITIONS[name], 8, 3.0, 3)


def arrays(batch: Batch) -> dict[str, Array]:
    found = {field.name: getattr(batch, field.name) for field in dataclasses.fields(Batch)}
    found |= {f"truth.{field.name}": getattr(batch.truth, field.name) for field in dataclasses.fields(batch.truth)}
    return {name: value for name, value in found.items() if isinstance(value, np.ndarray)}


def same_variance(values: Array, sigma: float) -> bool:
    """Return whether the mean square of Gaussian values is sigma², at a probability of 0.1 % to be wrong."""
    low, high = chi2.ppf((5e-4, 1.0 - 5e-4), values.size)
    return bool(low < np.sum(np.square(values)) / sigma**2 < high)


# --- reproducible ----------------------------------------------------------------------------------------------------


@every
def test_the_seed_makes_the_batch_to_the_bit(name: str) -> None:
    again, other = (matched(CONDITIONS[name], 3, 3.0, seed) for seed in (3, 4))
    for key, value in arrays(again).items():
        np.testing.assert_array_equal(
            value, arrays(drawn(name))[key][:3], err_msg=f"{key}: run i depends on their number"
        )
        assert key == "trim" or not np.array_equal(value, arrays(other)[key]), key
    assert all(value.dtype == np.float64 for value in arrays(again).values())


# --- the right statistics --------------------------------------------------------------------------------------------


@every
def test_parameters_are_the_random_walk_of_the_settings(name: str) -> None:
    batch, known = drawn(name), drawn(name).knowledge
    assert batch.truth.p is not None
    steps = np.diff(known.scaled(batch.truth.p), axis=1)
    for index in range(3):
        assert same_variance(steps[..., index], known.walk_w[index] * math.sqrt(batch.period))


def test_the_start_is_drawn_from_the_prior() -> None:
    sigma = {"m_p_sigma": 0.1, "c_p_sigma": 0.2, "k_p_sigma": 0.3}
    batch = matched(Condition(settings=sigma), 1000, 2e-3, 7)
    assert batch.samples == 2
    assert batch.truth.p is not None
    w = np.log(batch.truth.p[:, 0] / [DEFAULTS[name] for name in ("m_p", "c_p", "k_p")])
    for index, value in enumerate(sigma.values()):
        assert kstest(w[:, index] / value, "norm").pvalue > 1e-3
    assert np.abs(np.corrcoef(w.T) - np.eye(3)).max() < 3.5 / math.sqrt(1000)


@every
def test_process_noise_is_an_integrated_random_walk(name: str) -> None:
    """What the model does not explain of the truth: covariance q² [[dt³/3, dt²/2], [dt²/2, dt]], nothing over time."""
    batch = drawn(name)
    assert batch.truth.p is not None
    w, q, dt = batch.knowledge.scaled(batch.truth.p), batch.knowledge.process_noise, batch.period
    x = batch.truth.x - np.stack((batch.trim, np.zeros_like(batch.trim)), axis=-1)
    rest = np.stack([x[:, k + 1] - batch.move(k, x[:, k], w[:, k]) for k in range(0, batch.samples - 1, 3)], axis=1)
    scaled = rest / (q * np.array([math.sqrt(dt**3 / 3), math.sqrt(dt)]))
    assert same_variance(scaled[..., 0], 1.0)
    assert same_variance(scaled[..., 1], 1.0)
    product = scaled[..., 0] * scaled[..., 1]
    assert product.mean() == pytest.approx(math.sqrt(3) / 2, abs=4.0 * product.std() / math.sqrt(product.size))
    later = scaled[:, 1:] * scaled[:, :-1]
    assert np.abs(later.mean(axis=(0, 1))).max() < 4.0 / math.sqrt(rest.shape[0] * rest.shape[1])


@every
def test_inputs_have_their_rms_and_band(name: str) -> None:
    batch, condition = drawn(name), CONDITIONS[name]
    for index, rms in enumerate((condition.base_rms, condition.dither_rms)):
        np.testing.assert_allclose(np.sqrt(np.mean(np.square(batch.u[..., index]), axis=1)), rms, rtol=1e-12)
        frequency, power = signal.periodogram(batch.u[..., index], 1.0 / batch.period)
        within = (frequency >= 1.0) & (frequency <= 10.0)
        assert power[:, ~within].sum() < 1e-20 * power.sum()
    np.testing.assert_array_equal(batch.raw_u, batch.u)


# --- the right motion ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preload", ["fixed", "trim"])
def test_the_lever_starts_at_rest_and_has_the_dynamics_of_the_plant(preload: lever_plant.Preload) -> None:
    """sil/lever_sil/plants/lever_plant.py shares no code with the model here."""
    settings = {"arm_preload_angle": 0.45, "lever_preload_angle": 0.3}
    batch = matched(Condition(preload=preload, settings=settings), 6, 2.0, 5)
    assert batch.truth.p is not None
    lever = lever_plant.Lever.from_settings(DEFAULTS | settings)
    np.testing.assert_array_equal(batch.truth.x[:, 0, 1], 0.0)
    for run, p in enumerate(batch.truth.p):
        truth = lever_plant.Truth(p[:, 0], p[:, 1], p[:, 2], np.full(batch.samples, math.radians(20.0)))
        rest, dynamics = lever_plant.equilibrium(lever, truth, preload), lever_plant.dynamics(lever, truth, preload)
        assert batch.truth.x[run, 0, 0] == pytest.approx(rest[0], abs=1e-12)
        np.testing.assert_allclose(batch.rest(np.arange(batch.samples))[run], rest, atol=1e-12)
        np.testing.assert_allclose(batch.truth.dynamics[run, :, 0], dynamics.natural_frequency, rtol=1e-9)
        np.testing.assert_allclose(batch.truth.dynamics[run, :, 1], dynamics.damping_ratio, rtol=1e-9)


def test_without_noise_the_black_box_is_a_linear_system() -> None:
    still = {"a21_walk": 0.0, "a22_walk": 0.0, "b21_walk": 0.0, "theta_dot_process_noise": 0.0}
    batch = matched(Condition("linear_black_box", settings=BLACK_BOX | still), 3, 4.0, 9)
    assert batch.truth.p is not None
    time = np.arange(batch.samples) * batch.period
    for run in range(batch.runs):
        a21, a22, b21 = batch.truth.p[run, 0]
        system = signal.StateSpace([[0.0, 1.0], [a21, a22]], [[0.0], [b21]], np.eye(2), np.zeros((2, 1)))
        exact = signal.lsim(system, batch.u[run, :, 0], time)[1]
        moved = batch.truth.x[run] - [math.radians(20.0), 0.0]
        assert np.abs(moved - exact).max(axis=0) == pytest.approx(0.0, abs=1e-3 * np.abs(exact).max())


def test_where_an_unknown_truth_rests_is_not_made_up() -> None:
    at = np.array([0, 7])
    unknown = {
        name: dataclasses.replace(drawn(name), truth=dataclasses.replace(drawn(name).truth, p=None))
        for name in ("lever trim", "lever fixed")
    }
    np.testing.assert_array_equal(unknown["lever trim"].rest(at), math.radians(20.0))
    with pytest.raises(ValueError, match="is not known"):
        unknown["lever fixed"].rest(at)


# --- bounds, and what is refused -------------------------------------------------------------------------------------


def test_parameters_stay_within_the_bounds_of_the_model() -> None:
    settings = {"m_p_sigma": 1.2, "c_p_sigma": 1.2, "k_p_sigma": 1.2, "k_p_walk": 0.5}
    batch = matched(Condition(settings=settings), 30, 2.0, 3)
    limits = {row.name: (row.least, row.greatest) for row in settings_table()}
    assert batch.truth.p is not None
    for index, name in enumerate(("m_p", "c_p", "k_p")):
        least, greatest = limits[name]
        p = batch.truth.p[..., index]
        assert least <= p.min()
        assert 0.5 * greatest < p.max() <= greatest  # three standard deviations would be beyond


def test_conditions_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match='"pendulum" is none of lever, linear_physical'):
        matched(Condition("pendulum"), 1, 1.0, 1)
    with pytest.raises(ValueError, match='"loose" is neither'):
        matched(Condition(preload="loose"), 1, 1.0, 1)
    with pytest.raises(ValueError, match="theta_process_noise must be 0"):
        matched(Condition(settings={"theta_process_noise": 0.1}), 1, 1.0, 1)
    with pytest.raises(SettingsError, match="did you mean theta_noise"):
        matched(Condition(settings={"theta_nois": 1e-3}), 1, 1.0, 1)
    with pytest.raises(ValueError, match="none stays within the bounds"):  # no stiffness that would hold it
        matched(Condition("linear_black_box", settings={"a21": 3000.0, "a21_sigma": 1.0}), 1, 0.01, 1)
