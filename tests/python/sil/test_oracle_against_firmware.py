"""The C filter in single precision against the oracle in double, fed the same samples."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from lever_cdkf.host_tools.native import Config, run_samples
from lever_cdkf.sil import oracle
from lever_cdkf.sil.oracle.dual import model_of
from lever_cdkf.sil.oracle.scale import PARAMETERS
from numpy.typing import NDArray

Array = NDArray[Any]
DERIVED = ("natural_frequency", "damping_ratio")
BOUNDS = {  # of firmware/model
    "lever": np.array(((0.3, 10.0), (2.0, 400.0), (50.0, 6500.0))),
    "linear_physical": np.array(((0.05, 60.0), (0.1, 600.0), (1.0, 6500.0))),
    "linear_black_box": np.array(((-3200.0, 3200.0), (-320.0, 320.0), (-32.0, 32.0))),
}
PILOTS = {  # none the first guess
    "lever": np.array(((3.2,), (60.0,), (2100.0,))),
    "linear_physical": np.array(((3.2,), (60.0,), (2100.0,))),
    "linear_black_box": np.array(((-620.0,), (-19.0,), (-2.8,))),
}
TORQUE = {"lever": 0.3, "linear_physical": 1.6, "linear_black_box": 0.0}  # rms; [N m], [N]
NOT_REPEATED = {"change_threshold": 0.0, "noise_window": 0.0}  # by the oracle: these are off
PRELOADED = {"arm_preload_angle": 0.4, "lever_preload_angle": 0.36}
EVERY = 10  # samples from one comparison to the next: not a multiple of those that are learnt from at once


def single(values: Array) -> Array:
    """As the firmware sees them."""
    return values.astype(np.float32)


def band_limited(rng: np.random.Generator, count: int, rms: float) -> Array:
    """Noise between 1 and 10 Hz at 1 kHz."""
    frequency = np.fft.rfftfreq(count, 1e-3)
    inside = (frequency > 1.0) & (frequency < 10.0)
    spectrum = inside * np.exp(2j * np.pi * rng.random(frequency.size))
    noise = np.fft.irfft(spectrum, count)
    limited: Array = rms * noise / noise.std()
    return limited


@functools.cache
def recorded(model: str, preload: str, seconds: float) -> dict[str, Array]:
    """A pilot who stiffens by 30 % half way; before that the sensors drop out one after the other, and both at once."""
    rng = np.random.default_rng(7)
    count = round(seconds * 1e3)
    z_ddot, tau_m = band_limited(rng, count, 0.98), band_limited(rng, count, TORQUE[model])
    plant = model_of(Config().settings | PRELOADED, model, preload)
    x, trim = np.array([[0.35], [0.0]]), 0.35
    truth = np.empty((count, 2))
    disturbance = 0.05 * np.sqrt(1e-3) * rng.standard_normal(count)
    for k in range(count):
        p = PILOTS[model] * (1.0 if k < count // 2 else 1.3)
        x = plant.step(x, p, (z_ddot[k], tau_m[k]), trim, 1e-3)
        x[1] += disturbance[k]
        truth[k] = x[:, 0]
    part = np.arange(count) / count
    theta_valid = (part < 0.40) | (part > 0.43)
    theta_dot_valid = (part < 0.42) | (part > 0.45)
    return {
        "time_us": np.arange(count) * 1000,
        "theta": single(truth[:, 0] + 1e-3 * rng.standard_normal(count)),
        "theta_dot": single(truth[:, 1] + 1e-2 * rng.standard_normal(count)),
        "z_ddot": single(z_ddot),
        "tau_m": single(tau_m),
        "theta_valid": theta_valid,
        "theta_dot_valid": theta_dot_valid,
    }


@dataclass(frozen=True)
class Case:
    """Of the choices and settings of the estimator what differs from the others."""

    model: str = "lever"
    estimator: str = "dual"
    adaptation: str = "fixed"
    samples: int = 4  # from which the parameters learn at once
    preload: str = "trim"
    seconds: float = 5.0
    form: str = ""  # of the oracle, where it is not named like the estimator

    def __str__(self) -> str:
        return "-".join((self.model, self.form or self.estimator, self.adaptation, self.preload, str(self.samples)))


CASES = (
    *(Case(model, estimator, samples=k) for model in PARAMETERS for estimator in ("dual", "joint") for k in (1, 4, 25)),
    *(Case(model, "joint", samples=1, form="whole") for model in PARAMETERS),
    *(Case(model, "joint", preload="fixed") for model in PARAMETERS),
    *(Case(adaptation=adaptation) for adaptation in ("annealing", "forgetting")),
    Case("linear_physical", "joint", "annealing"),
    Case("linear_black_box", "dual", "robbins_monro"),
    Case("linear_black_box", "joint", "forgetting"),
    Case("lever", "joint", "robbins_monro", seconds=20.0),
    Case("lever", "dual", "robbins_monro", seconds=60.0),
)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_float_differs_from_double_by_less_than_a_hundredth_of_sigma(case: Case) -> None:
    samples = recorded(case.model, case.preload, case.seconds)
    settings = NOT_REPEATED | PRELOADED | {"learn_period": 1e-3 * case.samples}
    if case.form == "whole":
        settings |= {"caution_time": 0.0}
    config = Config(case.model, case.preload, case.estimator, case.adaptation, settings)
    firmware = run_samples(config, samples)
    inputs = {name: np.asarray(values, float) for name, values in samples.items()}
    inputs["time_s"] = inputs["time_us"] * 1e-6
    start, first = oracle.align(inputs, config.settings)
    double = oracle.DualFilter(
        config.settings,
        start,
        case.preload,
        case.adaptation,
        BOUNDS[case.model],
        case.model,
        case.form or case.estimator,
    )
    expected = oracle.run(double, inputs, first, EVERY)

    names, rows = PARAMETERS[case.model], slice(first, None, EVERY)
    got = {name: firmware["parameter"][rows, i] for i, name in enumerate(names)}
    got |= {name: firmware[name][rows] for name in (*DERIVED, "theta", "theta_dot")}
    for name, values in got.items():
        assert np.abs((values - expected[name]) / expected[f"{name}_sigma"]).max() < 0.01, name
    for i, name in enumerate(names):
        assert firmware["parameter_sigma"][rows, i] == pytest.approx(expected[f"{name}_sigma"], rel=2e-3), name
    for name in ("theta_sigma", "theta_dot_sigma"):
        known = np.asarray(inputs[f"{name.removesuffix('_sigma')}_valid"][rows], bool)
        assert firmware[name][rows][known] == pytest.approx(expected[name][known], rel=2e-3), name
    assert firmware["nis"][rows] == pytest.approx(expected["nis"], rel=5e-3, abs=5e-3)
