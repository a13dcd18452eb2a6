"""Before and after: what the estimator makes of the log with both settings, on the part tuned on and on the other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..firmware.settings_file import Assignments, make_config
from ..numeric.arrays import Array
from ..results import whiteness
from ..text.counts import counted
from .likelihood import Likelihood, noise_as_set

_BLOCK = 0.5
"""Gains are averaged over so long [s] before their error is told from their scatter: they are not quite white."""
_CLEAR = 3.0  # standard errors from which on it is better; they are of few blocks
_WORSE = 2.0  # and worse: settings that may do harm are not written


@dataclass(frozen=True)
class Fit:
    """How well one part of the log goes with some settings."""

    settings: str
    """"before" or "after"."""
    noise: str
    """"as set", or "estimated": while running, as the settings have it."""
    part: str
    """"tuned on" or "held out"."""
    innovations: Array
    """Of the part."""
    period: float

    @property
    def log_likelihood(self) -> float:
        """Per sample [nat]."""
        return float(np.mean(self.innovations["log_likelihood"]))

    @property
    def nis(self) -> float:
        """Mean of the normalised innovation squared, an output [1]: 1 where the stated covariance is right."""
        return float(np.sum(self.innovations["nis"]) / max(1, int(np.sum(self.innovations["size"]))))

    @property
    def correlation(self) -> whiteness.Whiteness | None:
        """Of the innovations of theta_dot; None where there are too few."""
        values = np.where(self.innovations["sigma"][:, 1] > 0.0, self.innovations["value"][:, 1], np.nan)
        return whiteness.measure(values.astype(np.float64), self.period)

    @property
    def largest_correlation(self) -> float | None:
        """The one of `correlation` that is farthest from 0 [1]."""
        measured = self.correlation
        return None if measured is None else round(measured.largest, 3)


@dataclass(frozen=True)
class Gain:
    """After minus before, in the logarithm of the likelihood per sample [nat]."""

    mean: float
    error: float
    """Its standard error."""

    @property
    def is_better(self) -> bool:
        """Whether it is more than chance."""
        return self.mean > _CLEAR * self.error

    @property
    def is_worse(self) -> bool:
        """Whether it is a loss that is more than chance."""
        return self.mean < -_WORSE * self.error

    def __str__(self) -> str:
        return f"{self.mean:+.4f} ± {self.error:.4f} nat a sample"


def fits(likelihood: Likelihood, before: Assignments, after: Assignments) -> list[Fit]:
    """Return the fits of both settings on both parts.

    They are with noise as set and, if the settings have that, estimated while running.
    """
    ways: dict[str, Mapping[str, Mapping[str, str | float]]] = {
        "as set": {"before": noise_as_set(before), "after": noise_as_set(after)}
    }
    if make_config(before).settings["noise_window"] > 0.0:
        ways["estimated"] = {"before": before, "after": after}
    results = []
    for noise, variants in ways.items():
        for name, assignments in variants.items():
            whole = likelihood.run(assignments)
            for part, where in (("tuned on", likelihood.tuned_on), ("held out", likelihood.judged_by)):
                if where.any():
                    results.append(Fit(name, noise, part, whole[where], likelihood.recording.period))
    return results


def pairs(results: Sequence[Fit]) -> list[tuple[Fit, Fit]]:
    """Before and after, for each way to have the noise and each part."""
    after = {(fit.noise, fit.part): fit for fit in results if fit.settings == "after"}
    return [(fit, after[fit.noise, fit.part]) for fit in results if fit.settings == "before"]


def gain(before: Fit, after: Fit) -> Gain:
    """Return what tuning has gained on a part."""
    difference = after.innovations["log_likelihood"] - before.innovations["log_likelihood"]
    size = max(1, round(_BLOCK / after.period))
    blocks = difference[: len(difference) // size * size].reshape(-1, size).mean(axis=1)
    error = float(np.std(blocks, ddof=1)) / math.sqrt(len(blocks)) if len(blocks) > 1 else math.inf
    return Gain(float(np.mean(difference)), error)


def _held_out(results: Sequence[Fit]) -> dict[str, Gain]:
    """Return the gain on that part, by the way to have the noise; the last is the one in flight."""
    return {before.noise: gain(before, after) for before, after in pairs(results) if before.part == "held out"}


def is_worse(results: Sequence[Fit]) -> bool:
    """Return whether the part held out goes worse with the new settings, with noise as in flight."""
    flown = list(_held_out(results).values())[-1:]
    return any(each.is_worse for each in flown)


def verdict(results: Sequence[Fit], changed: int) -> str:
    """In a sentence or two."""
    if not changed:
        return "The log contradicts none of the settings: nothing to tune."
    settings = f"{counted(changed, 'setting')} changed."
    gains = [
        f"{_outcome(each)} with noise {'as set' if noise == 'as set' else 'estimated while running'} ({each})"
        for noise, each in _held_out(results).items()
    ]
    return f"{settings} On the part not tuned on: {'; '.join(gains)}." if gains else f"{settings} Nothing was held out."


def _outcome(gain: Gain) -> str:
    if gain.is_better:
        return "better"
    return "worse" if gain.is_worse else "no clear difference"
