"""An estimator of anybody's in the comparison: `lever compare --score MODULE:CLASS`, as PAPER.md shows.

It is a class with three methods, made anew for each run. It sees one sample after the other, and nothing of the truth.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from lever_cdkf.errors import LeverError
from lever_cdkf.numeric.arrays import Array
from numpy.typing import NDArray

from .data import PARAMETERS, Batch, Estimates, Estimator, Knowledge, Model


class Sample(NamedTuple):
    """What the sensors say at one time.

    With preload trim all signals are deviations from their slow part, made causally (detrended.py), and `trim` is that
    of theta; with preload fixed they are as measured, and `trim` is 0.
    """

    time: float
    """[s]"""
    theta: float
    """[rad]"""
    theta_dot: float
    """[rad/s]"""
    z_ddot: float
    """[m/s²]"""
    tau_m: float
    """[N m]; a force [N] for linear_physical."""
    trim: float
    """[rad]"""


@dataclass(frozen=True)
class Config:
    """What an estimator is given before the first sample."""

    model: Model
    """The equations, for those who want them: move()."""
    period: float
    """Of the samples [s]."""
    knowledge: Knowledge
    """First guess of the parameters, its standard deviation, their random walk; noise of outputs and process."""

    def move(self, x: Array, p: Array, before: Sample, after: Sample) -> Array:
        """Return the states at a sample, of those at the sample before.

        Parameters
        ----------
        x
            The states (2,) at `before`: theta [rad] and theta_dot [rad/s], as in Sample.
        p
            The parameters (3,) in physical units.
        before, after
            The two samples.

        Returns
        -------
        array
            The states (2,) at `after`.
        """
        u = (0.5 * (before.z_ddot + after.z_ddot), 0.5 * (before.tau_m + after.tau_m))
        rest = np.array((before.trim, 0.0))
        moved: Array = self.model.step(x + rest, p, u, before.trim, self.period) - rest
        return moved


class Candidate(Protocol):
    """The three methods."""

    def start(self, config: Config) -> None:
        """Begin a run.

        Parameters
        ----------
        config
            What is known before the first sample.
        """

    def step(self, sample: Sample) -> None:
        """Take the next sample.

        Parameters
        ----------
        sample
            What the sensors say.
        """

    def estimate(self) -> tuple[Array, Array | None]:
        """Return the estimate after the last sample.

        Returns
        -------
        tuple of array and (array or None)
            The parameters (3,) in physical units, and their covariance (3, 3); None if it has none to state.
        """


def candidate(name: str) -> Estimator:
    """Return the class MODULE:CLASS as an estimator; modules are looked for in the current folder, too.

    Raise LeverError if there is no such class, or one of its methods is missing.
    """
    module, _, attribute = name.partition(":")
    if not (module and attribute):
        raise LeverError(f'"{name}": name an estimator as MODULE:CLASS, e.g. mine:Ukf for the class Ukf in mine.py')
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        make = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise LeverError(f"{name}: cannot be imported: {error}") from None
    for method in ("start", "step", "estimate"):
        if not callable(getattr(make, method, None)):
            raise LeverError(f"{name}: has no method {method}(); an estimator has start(), step() and estimate()")
    return partial(_run, make)


def _run(make: Callable[[], Candidate], batch: Batch, at: NDArray[np.int64]) -> Estimates:
    """Estimate one run after the other. A numpy.linalg.LinAlgError ends a run: it has broken down."""
    p = np.full((batch.runs, len(at), PARAMETERS), np.nan)
    covariance = np.full((*p.shape, PARAMETERS), np.nan)
    config, wanted, states_any = Config(batch.model, batch.period, batch.knowledge), set(at.tolist()), False
    signals = np.concatenate((batch.y, batch.u, batch.trim[..., np.newaxis]), axis=-1)
    for run in range(batch.runs):
        own, column = make(), 0
        try:
            own.start(config)
            for k, row in enumerate(signals[run, : at[-1] + 1].tolist()):
                own.step(Sample(k * batch.period, *row))
                if k in wanted:
                    p[run, column], stated = _checked(*own.estimate())
                    if stated is not None:
                        covariance[run, column], states_any = stated, True
                    column += 1
        except np.linalg.LinAlgError:
            continue
    with np.errstate(invalid="ignore", divide="ignore"):  # a mass below 0 is an estimator that broke down
        w = batch.knowledge.scaled(p)
    scale = p if batch.knowledge.positive else np.broadcast_to(batch.knowledge.sigma, p.shape)
    covariance /= scale[..., :, np.newaxis] * scale[..., np.newaxis, :]
    return Estimates(at, w, covariance if states_any else None)


def _checked(p: Array, covariance: Array | None) -> tuple[Array, Array | None]:
    for what, value, shape in (("parameters", p, (3,)), ("covariance", covariance, (3, 3))):
        if value is not None and np.shape(value) != shape:
            raise LeverError(f"estimate(): {what} have the shape {np.shape(value)}; {shape} is needed")
    return p, covariance
