"""What every estimator of a comparison gets, and what it gives back: batches of runs, in float64.

A batch is B runs (random seeds) of K samples; all arrays have the run first. Estimators work on w, the scaled
parameters: w = ln(p / guess) for those that are positive, w = (p - guess) / sigma for signed ones (the black box). So w
starts at 0 with the standard deviations `Knowledge.sigma_w`, and a random walk of w is a relative one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

STATES, PARAMETERS, OUTPUTS = 2, 3, 2

_NEWTON_STEPS, _NEWTON_DIFFERENCE, _NEWTON_TOLERANCE = 30, 1e-6, 1e-9  # the latter two in rad


class Model(Protocol):
    """A model of arm and lever, as those of lever_cdkf.models."""

    @property
    def preload(self) -> str:
        """Return "fixed" or "trim"."""

    def step(self, x: Array, p: Array, u: tuple[float | Array, float | Array], trim: float | Array, dt: float) -> Array:
        """Return states (2, …) dt [s] later, of parameters (3, …) in physical units."""

    def dynamics(self, p: Array, trim: float | Array) -> Array:
        """Return natural frequency [Hz] and damping ratio [1], (2, …), of parameters (3, …).

        They are those about the angle `trim` [rad].
        """


@dataclass(frozen=True)
class Knowledge:
    """What an estimator is given before the first sample. The names are those of the firmware's settings."""

    guess: Array
    """(3,) first guess of the parameters, physical units."""
    sigma: Array
    """(3,) its standard deviation: relative for positive parameters, in physical units for signed ones."""
    walk: Array
    """(3,) random walk of the parameters, [1/√s] relative or [unit/√s]."""
    positive: bool
    """Whether the parameters are positive and so scaled by their logarithm."""
    output_noise: Array
    """(2,) standard deviation of a sample of theta [rad], theta_dot [rad/s]."""
    process_noise: float
    """Random walk of theta_dot: torque that is not modelled [rad/s/√s]."""

    def physical(self, w: Array) -> Array:
        """Return p in physical units of w, both (…, 3)."""
        p: Array = self.guess * np.exp(w) if self.positive else self.guess + self.sigma * w
        return p

    def scaled(self, p: Array) -> Array:
        """Return w of p in physical units, both (…, 3)."""
        w: Array = np.log(p / self.guess) if self.positive else (p - self.guess) / self.sigma
        return w

    @property
    def sigma_w(self) -> Array:
        """(3,) standard deviation of w at the start."""
        return self.sigma if self.positive else np.ones(PARAMETERS)

    @property
    def walk_w(self) -> Array:
        """(3,) random walk of w [1/√s]."""
        return self.walk if self.positive else self.walk / self.sigma

    def process_covariance(self, dt: float) -> Array:
        """Return (2, 2) of the state over dt [s]: an integrated random walk of theta_dot (van Loan 1978)."""
        q = self.process_noise**2
        return q * np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])


def rest_angle(model: Model, p: Array, trim: Array, period: float) -> Array:
    """Return angle (…) [rad] at which parameters p (3, …) rest; NaN where they do not hold the lever.

    With preload trim that is the trim; with preload fixed it is where a step from rest changes no rate (Newton's
    method, with differences for slopes).
    """
    if model.preload == "trim":
        return trim

    def push(angle: Array) -> Array:
        moved: Array = model.step(np.array((angle, np.zeros_like(angle))), p, (0.0, 0.0), 0.0, period)[1]
        return moved

    angle, change = np.zeros(p.shape[1:]), np.full(p.shape[1:], np.inf)
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            here = push(angle)
            change = here * _NEWTON_DIFFERENCE / (push(angle + _NEWTON_DIFFERENCE) - here)
            angle = angle - change
            if np.abs(change).max(initial=0.0) < _NEWTON_TOLERANCE:
                break
    return np.where(np.abs(change) < _NEWTON_TOLERANCE, angle, np.nan)


@dataclass(frozen=True)
class Truth:
    """What no estimator sees."""

    x: Array
    """(B, K, 2) theta [rad], theta_dot [rad/s], as the sensors count them."""
    p: Array | None
    """(B, K, 3) parameters in physical units; None where the truth is no member of the model."""
    dynamics: Array
    """(B, K, 2) natural frequency [Hz], damping ratio [1]."""


@dataclass(frozen=True)
class Batch:
    """B runs of K samples.

    With preload trim, `y` and `u` are deviations from the slow part of each signal and `trim` is that of theta, as
    firmware/filter/trim.h makes them; with preload fixed they are as measured, and `trim` is 0.
    """

    model: Model
    period: float
    """[s]"""
    y: Array
    """(B, K, 2) measured theta [rad], theta_dot [rad/s]."""
    u: Array
    """(B, K, 2) known inputs at the samples: z_ddot [m/s²], tau_m [N m]."""
    trim: Array
    """(B, K) [rad]."""
    knowledge: Knowledge
    truth: Truth
    raw_y: Array
    """(B, K, 2) y before detrending: what the firmware, which detrends by itself, is fed with."""
    raw_u: Array
    """(B, K, 2) u before detrending."""
    missing: NDArray[np.bool_] | None = None
    """(B, K, 2) which of y are missing, for the joint filters alone; None: none."""

    @property
    def runs(self) -> int:
        """How many runs there are."""
        return len(self.y)

    @property
    def samples(self) -> int:
        """How many samples a run has."""
        return int(self.y.shape[1])

    def rest(self, at: NDArray[np.int64]) -> Array:
        """Return (B, T) angle [rad] at which the lever rests at the samples `at`, about which its dynamics are told.

        With preload fixed that depends on the parameters: raises ValueError if there are none to be known.
        """
        if self.model.preload == "trim":
            return self.trim[:, at]
        if self.truth.p is None:
            raise ValueError("preload fixed: where a truth rests that is no member of the model is not known")
        return rest_angle(self.model, np.moveaxis(self.truth.p[:, at], -1, 0), self.trim[:, at], self.period)

    def move(self, k: int, x: Array, w: Array) -> Array:
        """Return states at sample k + 1 of states x (B, …, 2) at sample k with scaled parameters w (B, …, 3).

        The dimensions between are free (sigma points) and broadcast; inputs are the mean of both ends.
        """
        extra = (1,) * (max(x.ndim, w.ndim) - 2)
        shape = (self.runs, *extra)
        mean = 0.5 * (self.u[:, k] + self.u[:, k + 1])
        u = (mean[:, 0].reshape(shape), mean[:, 1].reshape(shape))
        trim = self.trim[:, k].reshape(shape)
        angle = np.stack((trim, np.zeros_like(trim)))
        states = np.moveaxis(x, -1, 0) + angle
        moved = self.model.step(states, np.moveaxis(self.knowledge.physical(w), -1, 0), u, trim, self.period) - angle
        return np.moveaxis(moved, 0, -1)


@dataclass(frozen=True)
class Estimates:
    """What an estimator made of a batch, at the T samples `at`."""

    at: NDArray[np.int64]
    """(T,) indices of samples, rising."""
    w: Array
    """(B, T, 3) scaled parameters; NaN from where an estimator broke down."""
    covariance: Array | None
    """(B, T, 3, 3) of w; None for an estimator that states none."""
    nis: Array | None = None
    """(B, T) normalised innovation squared, chi-square with 2 degrees of freedom if consistent."""


Estimator = Callable[[Batch, NDArray[np.int64]], Estimates]
"""Runs over a whole batch and reports at the given samples."""
