"""What the firmware states that calibration errors do to its estimates, against what they do.

The data are changed by a small gain, delay, or friction; the change of the estimates is the derivative that the
estimates' standard deviations are made of. Noise and pilot are not estimated anew meanwhile, so that both runs have the
same gains.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.native import Config, run_samples
from numpy.typing import NDArray
from oracle.estimator import model_of

Array = NDArray[Any]
COUNT = 12000  # samples, 1 kHz
AT = np.array((8000, COUNT - 1))
PILOTS = {"lever": np.array(((2.5,), (42.0,), (1500.0,))), "hand": np.array(((500.0,), (13.5,), (9.0,)))}
TRIM = 0.35
STOP_RATE = 0.002  # of the friction in firmware/app/prediction.c [rad/s]
FRICTION = 0.005  # [N m]
STEPS = {"z_ddot_gain": 0.005, "z_ddot_delay": 2e-4, "tau_m_gain": 0.01, "lever_friction": FRICTION}
LARGE = {"z_ddot_gain": 0.5, "z_ddot_delay": 0.01, "tau_m_gain": 0.5, "lever_friction": 5.0}
"""Standard deviations beside which the estimates' own uncertainty is small."""
CERTAIN = {f"{name}_sigma": 0.0 for name in STEPS}
ALIKE = {"change_threshold": 0.0, "noise_window": 0.0, "arm_preload_angle": 0.3984, "lever_preload_angle": TRIM}


@dataclass(frozen=True)
class Case:
    """Of a run."""

    preload: str = "trim"
    estimator: str = "dual"
    torque: float = 0.3  # rms [N m]
    model: str = "lever"
    dead: bool = False  # the accelerometer shows 0 for a second

    def __str__(self) -> str:
        return f"{self.model}-{self.preload}-{self.estimator}-{self.torque:g}" + "-dead" * self.dead


def band_limited(seed: int, rms: float, delay: float = 0.0) -> Array:
    """Return noise between 1.5 and 10 Hz, `delay` [s] late."""
    frequency = np.fft.rfftfreq(COUNT, 1e-3)
    inside = (frequency > 1.5) & (frequency < 10.0)
    spectrum = inside * np.exp(2j * np.pi * np.random.default_rng(seed).random(frequency.size))
    scale = rms / np.fft.irfft(spectrum, COUNT).std()
    late: Array = scale * np.fft.irfft(spectrum * np.exp(-2j * np.pi * frequency * delay), COUNT)
    return late


@functools.cache
def moved(model: str, preload: str, torque: float) -> Array:
    """θ and θ̇ of a lever with less friction than known, with as much, with more: (COUNT, 2, 3)."""
    rng = np.random.default_rng(1)
    arm = model_of(Config().settings | ALIKE, model, preload)
    base, motor = band_limited(2, 1.0), band_limited(3, torque)
    velocity = 1e-3 * np.cumsum(base)
    kick = 0.05 * np.sqrt(1e-3) * rng.standard_normal(COUNT)
    x = np.repeat(((TRIM,), (0.0,)), 3, axis=1)
    states = np.empty((COUNT, 2, 3))
    for k in range(COUNT):
        drive = (0.5 * (base[k] + base[k - 1]), 0.5 * (motor[k] + motor[k - 1]), velocity[k - 1])
        rate = 0.5 * (x[1] + arm.step(x, PILOTS[model], drive, TRIM, 1e-3)[1])  # at mid-step, but for friction itself
        stop = np.array((-FRICTION, 0.0, FRICTION)) * rate / (np.abs(rate) + STOP_RATE)
        x = arm.step(x, PILOTS[model], (drive[0], drive[1] - stop, drive[2]), TRIM, 1e-3)
        x[1] += kick[k]
        states[k] = x
    noisy: Array = states + rng.standard_normal((COUNT, 2, 1)) * np.array(((1e-3,), (1e-2,)))
    return noisy


def measured(case: Case, wrong: str = "", by: float = 0.0) -> dict[str, Array]:
    """Return what sensors show of which one, or the lever's friction, is wrong."""
    error = dict.fromkeys(STEPS, 0.0) | ({wrong: by} if wrong else {})
    y = moved(case.model, case.preload, case.torque)[:, :, 1 + int(np.sign(error["lever_friction"]))]
    base = (1.0 + error["z_ddot_gain"]) * band_limited(2, 1.0, error["z_ddot_delay"])
    if case.dead:
        base[5000:6000] = 0.0
    torque = (1.0 + error["tau_m_gain"]) * band_limited(3, case.torque)
    return {"time_us": np.arange(COUNT) * 1000, "theta": y[:, 0], "theta_dot": y[:, 1], "z_ddot": base, "tau_m": torque}


def estimates(case: Case, samples: dict[str, Array], **sigma: float) -> dict[str, Array]:
    settings = ALIKE | CERTAIN | {f"{name}_sigma": value for name, value in sigma.items()}
    found = run_samples(Config(case.model, case.preload, case.estimator, "fixed", settings), samples, AT)
    return {name: np.asarray(values, float) for name, values in found.items()}


@functools.cache
def right(case: Case) -> dict[str, Array]:
    """Return what the firmware says when nothing is wrong, and it knows that."""
    return estimates(case, measured(case))


def logarithmic_covariance(found: dict[str, Array]) -> Array:
    """Return the logarithmic covariance of the logarithms of the parameters (times, 3, 3)."""
    correlation = np.tile(np.eye(3), (len(AT), 1, 1))
    for pair, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        correlation[:, i, j] = correlation[:, j, i] = found["parameter_correlation"][:, pair]
    sigma = found["parameter_sigma"] / found["parameter"]
    return correlation * sigma[:, :, np.newaxis] * sigma[:, np.newaxis]


CASES = (
    *(Case(preload, estimator) for preload, estimator in (("trim", "dual"), ("trim", "joint"), ("fixed", "dual"))),
    Case(torque=0.0),
    Case(model="hand"),
    Case(torque=0.0, dead=True),
)


@pytest.mark.parametrize(
    ("case", "name"), [(case, name) for case in CASES for name in STEPS if case.torque or name != "tau_m_gain"], ids=str
)
@pytest.mark.requirement("R4")
def test_stated_is_what_a_small_error_does(case: Case, name: str) -> None:
    """To first order. What was learnt while the accelerometer was dead is taken back, the derivative not quite: the
    latest is taken for the one of then."""
    step, large = STEPS[name], LARGE[name]
    more, less = (estimates(case, measured(case, name, by)) for by in (step, -step))
    own, considered = right(case), estimates(case, measured(case), **{name: large})
    np.testing.assert_array_equal(own["parameter"], considered["parameter"])

    covariance = (logarithmic_covariance(considered) - logarithmic_covariance(own)) / large**2
    done = (more["parameter"] - less["parameter"]) / (2.0 * step) / own["parameter"]
    size = np.abs(done).max(axis=1)
    for k in (-1,) if case.dead else range(len(AT)):
        variance, direction = np.linalg.eigh(covariance[k])
        stated = np.sqrt(variance[-1]) * direction[:, -1]
        stated *= np.sign(stated @ done[k])  # a covariance does not tell
        assert np.abs(variance[:-1]).max() < 0.01 * variance[-1]
        np.testing.assert_allclose(stated, done[k], rtol=0.0, atol=(0.2 if case.dead else 0.12) * size[k])
        for of in ("natural_frequency", "damping_ratio"):
            change = abs(more[of][k] - less[of][k]) / (2.0 * step)
            alone = np.sqrt(considered[f"{of}_sigma"][k] ** 2 - own[f"{of}_sigma"][k] ** 2) / large
            assert alone == pytest.approx(change, rel=0.15, abs=0.02 * size[k] * own[of][k])


def test_an_error_that_is_known_is_made_up_for() -> None:
    """Estimates are those of right sensors and a lever without friction, within a tenth of what it would do."""
    case = Case()
    for name, step in STEPS.items():
        by = step if name == "lever_friction" else 5.0 * step
        neutral = 1.0 if name.endswith("gain") else 0.0
        settings = ALIKE | CERTAIN | {name: neutral + by}
        known = run_samples(Config("lever", "trim", "dual", "fixed", settings), measured(case, name, by), AT)
        unknown = estimates(case, measured(case, name, by))
        done = np.abs(unknown["parameter"] / right(case)["parameter"] - 1.0).max()
        np.testing.assert_allclose(known["parameter"], right(case)["parameter"], rtol=0.1 * done)
