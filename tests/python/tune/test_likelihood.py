"""The likelihood of the firmware's innovations against Kalman's textbook filter and, where the parameters are not
known, against the integral over all that they could be."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.innovations import innovations
from lever_cdkf.firmware.native import run_samples
from python.tune import textbook

GUESS = np.array([2.5, 42.0, 1500.0])
NAMES = ("m", "c", "k")
SIGMA = 0.04  # relative standard deviation of unknown parameters


def config(sigma: float, **settings: float) -> Config:
    """Return the config of the linear model with constant parameters near GUESS, which starts at the first sample,
    adapting nothing."""
    values: dict[str, float] = dict.fromkeys(("align_time", "caution_time", "change_threshold", "noise_window"), 0.0)
    values |= {"lever_preload_angle": 0.0, "excitation_least": 0.0, "theta_dot_process_noise": textbook.Q_RATE}
    values |= {"theta_noise": textbook.R[0], "theta_dot_noise": textbook.R[1]}
    for name, guess in zip(NAMES, GUESS, strict=True):
        values |= {name: guess, f"{name}_sigma": sigma, f"{name}_walk": 0.0}
    return Config("linear_physical", "fixed", adaptation="fixed", settings=values | settings)


def test_of_known_parameters_it_is_kalmans() -> None:
    samples = textbook.simulate(GUESS, 3000, seed=1)
    ours = innovations(config(sigma=1e-3), samples)["log_likelihood"].sum()
    assert ours == pytest.approx(textbook.log_likelihood(samples, GUESS[None])[0], abs=0.3)


@pytest.mark.parametrize(("learn_period", "within"), [(0.001, 0.3), (0.01, 1.0)])
def test_of_unknown_parameters_it_is_the_integral_over_them(learn_period: float, within: float) -> None:
    """What is predicted for each sample, given those before, multiplies to the density of all, integrated over normally
    distributed parameters (SIGMA) by Gauss and Hermite's rule; less exactly where several are learnt from at once, and
    while they are far off. Samples before the motion is seen to exceed the noise teach the firmware the state only."""
    samples = textbook.simulate(GUESS * np.array([0.93, 1.06, 1.08]), 740, seed=2)
    seen = innovations(config(SIGMA, learn_period=learn_period), samples)
    begin, block = int(seen["learns"].argmax()), round(learn_period / textbook.PERIOD)
    assert 1 < begin < len(samples) // 2
    assert seen["learns"][begin : len(samples) - block].all()
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    sets = np.array([GUESS * np.exp(SIGMA * np.array(node)) for node in product(nodes, repeat=3)])
    weight = np.prod(list(product(weights / weights.sum(), repeat=3)), axis=1)
    each = textbook.log_likelihood(samples, sets, begin)
    integral = float(each.max() + np.log(weight @ np.exp(each - each.max())))
    assert integral - each[len(each) // 2] > 10.0, "as likely as at GUESS: a test of nothing"
    assert seen["log_likelihood"][begin:].sum() == pytest.approx(integral, abs=within)


def test_the_filter_that_is_watched_is_the_firmware() -> None:
    """Its NIS is what the firmware says of itself, also where outputs are missing."""
    samples = textbook.simulate(GUESS * 1.1, 3000, seed=3)
    samples["theta_valid"][1000:1010] = False
    samples["theta_dot_valid"][1005:1020] = False
    seen = innovations(config(sigma=0.3), samples)
    columns = {name: samples[name] for name in samples.dtype.names or ()}
    columns["time_us"] = columns["time_us"].astype(np.int64)
    said = run_samples(config(sigma=0.3), columns)
    used = seen["size"] > 0
    assert used.sum() >= 2990
    assert (seen["size"][used] == said["nis_size"][used]).all()
    np.testing.assert_allclose(seen["nis"][used], said["nis"][used], rtol=2e-3, atol=1e-4)


def test_an_output_that_is_missing_says_nothing() -> None:
    """Without the rate, an innovation's density is that of the angle alone."""
    samples = textbook.simulate(GUESS, 2000, seed=4)
    samples["theta_dot_valid"][1000] = False
    seen = innovations(config(sigma=1e-3), samples)[1000]
    sigma, value = float(seen["sigma"][0]), float(seen["value"][0])
    assert (seen["value"][1], seen["sigma"][1], seen["size"]) == (0.0, 0.0, 1)
    density = -0.5 * (value / sigma) ** 2 - np.log(sigma * np.sqrt(2.0 * np.pi))
    assert seen["log_likelihood"] == pytest.approx(density, abs=0.01)
