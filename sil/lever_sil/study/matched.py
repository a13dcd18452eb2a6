"""Runs whose truth is exactly what a filter assumes: for linearised.py, bound.py and tests of consistency.

    w_0 ~ N(0, sigma²)            w_k+1 = w_k + walk √dt N(0, 1)
    x_0 at rest                   x_k+1 = f(x_k, p(w_k), mean of u_k and u_k+1) + N(0, Q)         y_k = x_k + N(0, R)

with the f that the filters use, every standard deviation the one of the settings, and inputs that are measured without
error. With preload trim the trim is constant and known: deviations from it are exact, nothing is lost by detrending.

In one thing truth and assumption differ: no filter of the firmware leaves the bounds of the model, so a run whose
parameters would is drawn again, and so is one whose arm does not hold the lever (a natural frequency or damping ratio
that is not positive). In a minute, with the firmware's settings, that befalls 15 levers and 34 black boxes in 1000.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from lever_cdkf.firmware.config import Config, setting
from lever_cdkf.models.lever import Lever
from lever_cdkf.models.linear import LinearBlackBox, LinearPhysical
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.text.units import GRAVITY

from .data import OUTPUTS, PARAMETERS, STATES, Batch, Knowledge, Model, Truth, rest_angle
from .draws import excitation, streams

_MOST_DRAWS = 1000  # of the parameters of one run


@dataclass(frozen=True)
class Kind:
    """A model as the firmware's settings have it."""

    make: Callable[[Mapping[str, float], str], Model]
    """Of settings and preload."""
    parameters: tuple[str, str, str]
    """Names of the settings with the first guesses; with _sigma and _walk, those of their uncertainty."""
    positive: bool


KINDS: Mapping[str, Kind] = {
    "lever": Kind(Lever.from_settings, ("m_p", "c_p", "k_p"), True),
    "linear_physical": Kind(LinearPhysical.from_settings, ("m", "c", "k"), True),
    "linear_black_box": Kind(LinearBlackBox.from_settings, ("a21", "a22", "b21"), False),
}
"""By the names of the firmware's models."""
PRIOR: Mapping[str, Mapping[str, float]] = {
    "lever": {"m_p_sigma": 0.25, "c_p_sigma": 0.3, "k_p_sigma": 0.3},
    "linear_physical": {"m_sigma": 0.25, "c_sigma": 0.3, "k_sigma": 0.3},
    "linear_black_box": {},
}
"""By model, of comparisons and figures: a first guess that is wrong by a quarter to a third, as in the scenarios."""


@dataclass(frozen=True)
class Condition:
    """What a batch is drawn from."""

    model: str = "lever"
    """One of KINDS."""
    preload: str = "trim"
    """"fixed" or "trim"."""
    base_rms: float = 0.1 * GRAVITY
    """Of z_ddot [m/s²]."""
    dither_rms: float = 0.0
    """Of tau_m [N m]."""
    band: tuple[float, float] = (1.0, 10.0)
    """Of both [Hz]."""
    trim: float = math.radians(20.0)
    """Angle at which the lever rests with preload trim [rad]."""
    settings: Mapping[str, float] = field(default_factory=dict)
    """By name, where they differ from the firmware's defaults: noises, walks, first guesses, the lever …"""

    def all_settings(self) -> dict[str, float]:
        """Return every setting. Raises SettingsError for one that the firmware would not take."""
        for name, value in self.settings.items():
            setting(name).check(value)
        settings = Config().settings | dict(self.settings)
        if settings["theta_process_noise"] != 0.0:
            raise ValueError("theta_process_noise must be 0: the truth has none")
        return settings


def knowledge(settings: Mapping[str, float], kind: Kind) -> Knowledge:
    """Return what a filter with these settings is given."""
    return Knowledge(
        guess=np.array([settings[name] for name in kind.parameters]),
        sigma=np.array([settings[f"{name}_sigma"] for name in kind.parameters]),
        walk=np.array([settings[f"{name}_walk"] for name in kind.parameters]),
        positive=kind.positive,
        output_noise=np.array([settings["theta_noise"], settings["theta_dot_noise"]]),
        process_noise=settings["theta_dot_process_noise"],
    )


def matched(condition: Condition, runs: int, duration: float, seed: int) -> Batch:
    """Return `runs` runs of `duration` [s].

    The same seed gives the same batch, to the bit, and run i whatever `runs` is.

    Raise ValueError for a model or preload that does not exist, and for settings by which hardly any draw of the
    parameters stays in the bounds.
    """
    if condition.model not in KINDS:
        raise ValueError(f'model: "{condition.model}" is none of {", ".join(KINDS)}')
    kind, settings = KINDS[condition.model], condition.all_settings()
    model, assumed = kind.make(settings, condition.preload), knowledge(settings, kind)
    period = settings["sample_period"]
    samples = max(2, round(duration / period))
    trim = np.full((runs, samples), condition.trim if condition.preload == "trim" else 0.0)
    drawn_from, time = streams(seed, runs), np.arange(samples, dtype=np.float64) * period

    rms = (condition.base_rms, condition.dither_rms)
    u = np.stack([excitation(rms, condition.band, time, own) for own in drawn_from])
    drawn = [_parameters(model, assumed, _bounds(kind), trim[0], period, own["pilot"]) for own in drawn_from]
    p, dynamics = (np.stack(part) for part in zip(*drawn, strict=True))
    kicks = np.stack([_kicks(assumed, samples - 1, period, own["process"]) for own in drawn_from])
    x = _states(model, p, u, trim, kicks, period)
    white = np.stack([own["output"].standard_normal((samples, OUTPUTS)) for own in drawn_from])
    raw_y = x + assumed.output_noise * white
    y = raw_y - np.stack((trim, np.zeros_like(trim)), axis=-1)
    return Batch(model, period, y, u, trim, assumed, Truth(x, p, dynamics), raw_y, u)


def tightened(batch: Batch, factors: Array) -> Batch:
    """Return the same runs, with the parameters times `factors` (K, 3): same inputs, same noises."""
    truth = batch.truth
    assert truth.p is not None
    p = truth.p * factors
    moment = int(np.argmax((factors != 1.0).any(axis=1)))  # the first that differs
    mean, x = 0.5 * (batch.u[:, 1:] + batch.u[:, :-1]), truth.x.copy()

    def step(states: Array, parameters: Array, k: int | slice) -> Array:
        inputs = (mean[:, k, 0], mean[:, k, 1])
        states, parameters = (np.moveaxis(part, -1, 0) for part in (states, parameters))
        return np.moveaxis(batch.model.step(states, parameters, inputs, batch.trim[:, k], batch.period), 0, -1)

    kicks = truth.x[:, 1:] - step(truth.x[:, :-1], truth.p[:, :-1], slice(0, batch.samples - 1))
    for k in range(moment, batch.samples - 1):
        x[:, k + 1] = step(x[:, k], p[:, k], k) + kicks[:, k]
    moved = np.moveaxis(p, -1, 0)
    dynamics = batch.model.dynamics(moved, rest_angle(batch.model, moved, batch.trim, batch.period))
    changed = replace(truth, x=x, p=p, dynamics=np.moveaxis(dynamics, 0, -1))
    return replace(batch, y=batch.y + x - truth.x, raw_y=batch.raw_y + x - truth.x, truth=changed)


def jump(samples: int, moment: int, factors: Array) -> Array:
    """Return (K, 3) factors for `tightened`: from sample `moment` on those given (3,)."""
    held = np.ones((samples, PARAMETERS))
    held[moment:] = factors
    return held


def _bounds(kind: Kind) -> Array:
    """Return (3, 2) least and greatest parameters of the model.

    They are those that settings take for the first guess.
    """
    return np.array([(setting(name).least, setting(name).greatest) for name in kind.parameters])


def _parameters(
    model: Model, assumed: Knowledge, bounds: Array, trim: Array, period: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return (K, 3) physical parameters of one run, within the bounds (3, 2), and (K, 2) their dynamics; trim (K,)."""
    scale = np.vstack((assumed.sigma_w, np.tile(math.sqrt(period) * assumed.walk_w, (len(trim) - 1, 1))))
    for _ in range(_MOST_DRAWS):
        p = assumed.physical(np.cumsum(scale * rng.standard_normal(scale.shape), axis=0))
        if (p >= bounds[:, 0]).all() and (p <= bounds[:, 1]).all():
            dynamics = model.dynamics(p.T, rest_angle(model, p.T, trim, period)).T
            if (dynamics > 0.0).all():
                return p, dynamics
    raise ValueError(f"of {_MOST_DRAWS} draws of the parameters none stays within the bounds of the model")


def _kicks(assumed: Knowledge, steps: int, period: float, rng: np.random.Generator) -> Array:
    """Return (K - 1, 2) process noise of one run: with the covariance of Knowledge.process_covariance."""
    white = assumed.process_noise * math.sqrt(period) * rng.standard_normal((steps, STATES))
    rate = white[:, 0]
    return np.stack((period * (rate / 2.0 + white[:, 1] / math.sqrt(12.0)), rate), axis=-1)


def _states(model: Model, p: Array, u: Array, trim: Array, kicks: Array, period: float) -> Array:
    """Return (B, K, 2) from rest; parameters (B, K, 3), inputs (B, K, 2), trim (B, K), process noise (B, K - 1, 2)."""
    mean = 0.5 * (u[:, 1:] + u[:, :-1])
    p, mean, kicks = (np.ascontiguousarray(part.transpose(1, 2, 0)) for part in (p, mean, kicks))
    trim = np.ascontiguousarray(trim.T)
    x = np.zeros((len(p), STATES, p.shape[2]))
    x[0, 0] = rest_angle(model, p[0], trim[0], period)
    for k, kick in enumerate(kicks):
        x[k + 1] = model.step(x[k], p[k], (mean[k, 0], mean[k, 1]), trim[k], period) + kick
    return np.ascontiguousarray(x.transpose(2, 0, 1))
