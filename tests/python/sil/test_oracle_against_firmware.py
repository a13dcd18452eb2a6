"""The C filter in single precision against the oracle in double, fed the same samples."""

from typing import Any

import numpy as np
import pytest
from lever_cdkf.host_tools.native import Config, run_samples
from lever_cdkf.sil import oracle
from numpy.typing import NDArray

Array = NDArray[Any]
PARAMETERS = ("m_p", "c_p", "k_p")
DERIVED = ("natural_frequency", "damping_ratio")
BOUNDS = np.array(((0.3, 10.0), (2.0, 400.0), (50.0, 6500.0)))  # of firmware/model/lever.c


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


def recorded(seconds: float) -> dict[str, Array]:
    """A minute of a pilot who stiffens by 30 % half way; with dropouts of either sensor, then of both."""
    rng = np.random.default_rng(7)
    count = round(seconds * 1e3)
    z_ddot, tau_m = band_limited(rng, count, 0.98), band_limited(rng, count, 0.3)
    lever = oracle.Lever.from_settings(Config().settings, "trim")
    x, trim = np.array([[0.35], [0.0]]), 0.35
    truth = np.empty((count, 2))
    disturbance = 0.05 * np.sqrt(1e-3) * rng.standard_normal(count)
    for k in range(count):
        p = np.array(((3.2,), (60.0,), (2100.0,))) * (1.0 if k < count // 2 else 1.3)
        x = lever.step(x, p, (z_ddot[k], tau_m[k]), trim, 1e-3)
        x[1] += disturbance[k]
        truth[k] = x[:, 0]
    theta_valid, theta_dot_valid = np.ones(count, bool), np.ones(count, bool)
    theta_valid[count // 4 : count // 4 + 1000] = False
    theta_dot_valid[count // 3 : count // 3 + 1000] = False
    theta_valid[-3000:-2800] = theta_dot_valid[-3000:-2800] = False
    return {
        "time_us": np.arange(count) * 1000,
        "theta": single(truth[:, 0] + 1e-3 * rng.standard_normal(count)),
        "theta_dot": single(truth[:, 1] + 1e-2 * rng.standard_normal(count)),
        "z_ddot": single(z_ddot),
        "tau_m": single(tau_m),
        "theta_valid": theta_valid,
        "theta_dot_valid": theta_dot_valid,
    }


@pytest.mark.parametrize("adaptation", ["fixed", "annealing", "robbins_monro"])
def test_float_differs_from_double_by_less_than_a_hundredth_of_sigma(adaptation: str) -> None:
    samples = recorded(60.0 if adaptation == "robbins_monro" else 20.0)
    config = Config(adaptation=adaptation)
    firmware = run_samples(config, samples)
    columns = {name: np.asarray(values, float) for name, values in samples.items()}
    columns["time_s"] = columns["time_us"] * 1e-6
    start, first = oracle.align(columns, config.settings)
    expected = oracle.run(oracle.DualFilter(config.settings, start, "trim", adaptation, BOUNDS), columns, first)

    got = {name: firmware["parameter"][first:, i] for i, name in enumerate(PARAMETERS)}
    got |= {name: firmware[name][first:] for name in (*DERIVED, "theta", "theta_dot")}
    for name, values in got.items():
        assert np.abs((values - expected[name]) / expected[f"{name}_sigma"]).max() < 0.01, name
    for i, name in enumerate(PARAMETERS):
        assert firmware["parameter_sigma"][first:, i] == pytest.approx(expected[f"{name}_sigma"], rel=2e-3), name
    assert firmware["nis"][first:] == pytest.approx(expected["nis"], rel=5e-3, abs=5e-3)
