"""The whole estimator of the float64 oracle against other filters on the same samples, limits, and closed forms."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.native import settings_table
from lever_cdkf.models.detrend import Detrend
from numpy.typing import NDArray
from oracle import Estimator, Lever, Start, cdkf
from oracle.change import ChangeDetection
from oracle.learning import seconds
from scipy.signal import butter, freqs

Array = NDArray[Any]  # of floats
Flags = NDArray[np.bool_]
AT_REST = {"arm_preload_angle": 0.3984, "lever_preload_angle": 0.35}  # preload fixed: PILOT's arm holds it at START
DEFAULTS = {row.name: row.default for row in settings_table()}
NEITHER = {"caution_time": 0.0, "noise_window": 0.0, "change_threshold": 0.0}  # as the other filters
SETTINGS = DEFAULTS | AT_REST | NEITHER
EACH_SAMPLE = SETTINGS | {"learn_period": 0.0}
PILOT = np.array([2.5, 42.0, 1500.0])
BOTH = np.array([True, True])
OUTPUT_NOISE = np.diag([SETTINGS["theta_noise"], SETTINGS["theta_dot_noise"]])
START = Start(np.array([0.35, 0.0]), np.diag([1e-3, 1e-2]), 0.35)


def recorded(count: int, pilot: Array = PILOT) -> dict[str, Array]:
    """Return samples of a pilot on a shaking floor, with the motor helping, at 1 kHz."""
    rng = np.random.default_rng(42)
    time = np.arange(count) * 1e-3
    lever, x = Lever.from_settings(SETTINGS, "fixed"), START.state[:, None]
    z_ddot = sum(np.sin(2 * np.pi * f * time + f) for f in (1.7, 2.9, 4.3, 6.1))
    tau_m = 0.3 * sum(np.cos(2 * np.pi * f * time - f) for f in (1.3, 3.7, 5.3))
    states = np.empty((count, 2))
    for k in range(count):
        if k:
            middle = (float(z_ddot[k] + z_ddot[k - 1]) / 2, float(tau_m[k] + tau_m[k - 1]) / 2)
            x = lever.step(x, pilot[:, None], middle, START.trim, 1e-3)
            x[1] += SETTINGS["theta_dot_process_noise"] * np.sqrt(1e-3) * rng.standard_normal()
        states[k] = x[:, 0]
    y = states + rng.standard_normal((count, 2)) * [SETTINGS["theta_noise"], SETTINGS["theta_dot_noise"]]
    return {"time": time, "y": y, "z_ddot": np.asarray(z_ddot), "tau_m": np.asarray(tau_m)}


def start_of(samples: dict[str, Array]) -> Start:
    inputs = (float(samples["z_ddot"][0]), float(samples["tau_m"][0]))
    return dataclasses.replace(START, state=samples["y"][0], input=inputs)


def feed(estimator: Estimator, samples: dict[str, Array], first: int, last: int, valid: Flags = BOTH) -> None:
    for k in range(first, last):
        estimator.step(samples["time"][k], samples["y"][k], valid, (samples["z_ddot"][k], samples["tau_m"][k]))


def estimate(estimator: Estimator) -> Array:
    """[w; x]."""
    return np.concatenate((estimator.belief.w, estimator.belief.x))


def process_covariance(t: float) -> Array:
    """Return what a step of t [s] adds to [w; x]: random walks of w, and a random walk of θ̇ with its integral in θ."""
    covariance = np.diag([*(SETTINGS[f"{name}_walk"] ** 2 * t for name in ("m_p", "c_p", "k_p")), 0.0, 0.0])
    power = SETTINGS["theta_dot_process_noise"] ** 2
    covariance[3:, 3:] = power * np.array([[t**3 / 3, t**2 / 2], [t**2 / 2, t]])
    return covariance


@pytest.mark.parametrize(("form", "share"), [("augmented", 1e-9), ("joint", 1e-9), ("dual", 5e-2)])
def test_it_is_the_joint_filter(form: str, share: float) -> None:
    """Against one plain CDKF on z = [w; x], written out here; within so many standard deviations.

    What a walk of w leaves unexplained of x, the dual filter drops and the joint one keeps.
    """
    samples = recorded(700, PILOT * [1.2, 0.8, 1.1])
    estimator = Estimator(EACH_SAMPLE, start_of(samples), "fixed", "fixed", estimator=form)
    estimator.learning.greatest_sigma = np.full(3, np.inf)
    estimator.excitation_square = estimator.motion_square = 1e3  # it has moved,
    estimator.learning.awake = seconds(1.0)  # and long enough
    lever = Lever.from_settings(SETTINGS, "fixed")
    z, factor = estimate(estimator), estimator.belief.joint_factor
    noise = np.linalg.cholesky(process_covariance(1e-3))
    for k in range(1, 700):
        u = tuple(0.5 * float(samples[name][k] + samples[name][k - 1]) for name in ("z_ddot", "tau_m"))

        def step(z: Array, u: tuple[float, ...] = u) -> Array:
            p = PILOT[:, None] * np.exp(z[:3])
            return np.concatenate((z[:3], lever.step(z[3:], p, (u[0], u[1]), estimator.trim, 1e-3)))

        z, first, second = cdkf.differences(step(cdkf.draw(z, factor)))
        factor = cdkf.tria(np.hstack((first, second, noise[:, 3:])))
        expected = cdkf.measure(z, factor, lambda z: z[3:], OUTPUT_NOISE)
        innovation = samples["y"][k] - expected.mean
        z, factor = cdkf.update(z, factor, expected, cdkf.gain(factor, expected), innovation)
        factor = cdkf.tria(np.hstack((factor, noise[:, :3])))  # the parameters walk when they have learnt

        feed(estimator, samples, k, k + 1)
        assert (np.abs(estimate(estimator) - z) < share * cdkf.deviations(factor)).all()
        assert estimator.nis == pytest.approx(cdkf.normalised_square(expected.factor, innovation), rel=share, abs=share)
    assert (np.abs(estimator.belief.joint_factor - factor) < share * cdkf.deviations(factor)[:, None]).all()


# --- the adaptations -------------------------------------------------------------------------------------------------


def test_annealing_falls_exponentially_to_the_floor() -> None:
    samples = recorded(1000)
    settings = SETTINGS | {"annealing_time": 0.5, "excitation_least": 0.0, "walk_ceiling": 10.0}
    estimator = Estimator(settings, start_of(samples), "fixed", adaptation="annealing")
    estimator.excitation_square = estimator.motion_square = 1e3  # it has moved,
    estimator.learning.awake = seconds(1.0)  # and long enough
    np.testing.assert_allclose(estimator.learning.walk, estimator.learning.ceiling)
    feed(estimator, samples, 1, 501)
    np.testing.assert_allclose(estimator.learning.walk, np.exp(-1.0) * estimator.learning.ceiling, rtol=1e-9)
    settings["annealing_time"] = 0.01
    feed(estimator, samples, 501, 1000)
    np.testing.assert_array_equal(estimator.learning.walk, estimator.learning.floor)


def test_robbins_monro_stays_between_floor_and_ceiling_and_uses_the_room() -> None:
    samples = recorded(1500, PILOT * [1.5, 0.5, 1.6])
    estimator = Estimator(SETTINGS | {"walk_ceiling": 3.0}, start_of(samples), "fixed", "robbins_monro")
    seen = []
    for k in range(1, 1500):
        feed(estimator, samples, k, k + 1)
        seen.append(estimator.learning.walk / estimator.learning.floor)
    assert np.min(seen) >= 1.0
    assert 2.0 < np.max(seen) <= 9.0 * (1.0 + 1e-12)


def test_without_motion_the_walk_is_at_its_floor_and_the_uncertainty_limited() -> None:
    nothing = np.zeros(2000)
    still = {"time": np.arange(2000) * 1e-3, "y": np.tile([0.35, 0.0], (2000, 1)), "z_ddot": nothing, "tau_m": nothing}
    walk = {f"{name}_walk": 0.5 for name in ("m_p", "c_p", "k_p")}
    estimator = Estimator(SETTINGS | walk, start_of(still), "fixed")
    feed(estimator, still, 1, 2000)
    np.testing.assert_array_equal(estimator.learning.walk, estimator.learning.floor)
    assert (cdkf.deviations(estimator.belief.w_factor) <= estimator.learning.greatest_sigma * (1.0 + 1e-9)).all()


# --- noise, and sudden changes ---------------------------------------------------------------------------------------


def test_white_corrections_are_no_change_and_a_drift_is() -> None:
    """The statistic is chi-square with three degrees of freedom: 30 has a probability of 1e-6."""
    rng, variance = np.random.default_rng(3), np.array([1.0, 4.0, 0.25])
    change = ChangeDetection(memory=0.3, threshold=30.0, prior_sigma=np.full(3, 0.5))
    white = rng.standard_normal((20000, 3)) * np.sqrt(variance)
    assert not any(change.step(correction, np.diag(variance), 0.02) for correction in white)
    assert change.average == pytest.approx(1.0, abs=0.3)
    drift = np.sqrt(variance) * [2.0, 0.0, 0.0]
    assert any(change.step(correction + drift, np.diag(variance), 0.02) for correction in white[:30])


# --- trim ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [0.1, 1.0, 4.0])
def test_detrending_is_a_butterworth_high_pass(frequency: float) -> None:
    time = np.arange(0.0, 30.0, 1e-3)
    detrend = Detrend()
    out = np.array([detrend.step(value, 1.0, 1e-3) for value in np.sin(2 * np.pi * frequency * time).tolist()])
    late = time >= 20.0
    wave = np.exp(-2j * np.pi * frequency * time[late])
    gain = (out[late] * wave).mean() / (np.sin(2 * np.pi * frequency * time[late]) * wave).mean()
    numerator, denominator = butter(6, 2 * np.pi, "highpass", analog=True)
    assert gain == pytest.approx(freqs(numerator, denominator, [2 * np.pi * frequency])[1][0], abs=0.015)


def test_a_level_follows_a_ramp_without_lag() -> None:
    detrend = Detrend()
    for k in range(5000):
        deviation = detrend.step(0.1 * k * 1e-3, 1.0, 1e-3)
    assert deviation == pytest.approx(0.0, abs=2e-4)
