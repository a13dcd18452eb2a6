"""Gain and delay of the accelerometer and friction of the lever, from a log with dither.

Maximum likelihood of the firmware's innovations, like all that is tuned, by the method of Berndt, Hall, Hall and
Hausman (1974): scores are the derivatives of each sample's log-likelihood, and the sum of their squares stands for the
information. The filter estimates the pilot's parameters meanwhile. Noise is looked for together with all else, since
too much of it looks like a wrong gain.

The delay is undone in the log, exactly. The firmware, which cannot look ahead, extrapolates, and that has a gain of its
own: 0.3 % on average with delays of 0 to 3 ms.

Torque and base give two scales, but pilot, accelerometer and torque sensor are three unknowns: the gain of the torque
sensor cannot be found beside that of the accelerometer. Its standard deviation becomes part of the others'.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfilt

from ..firmware.config import setting
from ..firmware.settings_file import Assignments, make_config
from ..numeric.arrays import Array
from ..results import whiteness
from ..text.counts import rounded_down
from .likelihood import LEARNT_LEAST, Likelihood, noise_as_set
from .search import NOISE, logarithmic_range

NAMES = ("z_ddot_gain", "z_ddot_delay", "lever_friction")
TORQUE_GAIN = "tau_m_gain"
DITHER_LEAST = 0.05
"""rms of the motor torque above DITHER_FROM, from which on it tells the pilot's mass [N m]."""
DITHER_FROM = 1.0  # [Hz]

_STEPS = {"z_ddot_gain": 2.5e-3, "z_ddot_delay": 1e-4, "lever_friction": 5e-3, TORQUE_GAIN: 5e-3}
_NOISE_STEP = 0.02  # of the logarithm
"""Of the differences that make the scores [unit of the setting]: about half a standard deviation of a minute's log."""
_FARTHEST = 1.0  # that the logarithm of a noise goes in one step
_ROUNDS = 12
_AGAIN = 2  # times that it is looked for in other parts of the log
_CONVERGED = 0.05  # standard deviations
_CONTRADICTED = 3.0  # likewise
_NOTHING = 1e-6  # likewise: a value at the end of its range, where the fit leaves 1e-17


@dataclass(frozen=True)
class Calibrated:
    """What the log says of one setting of the calibration."""

    name: str
    before: float
    sigma_before: float
    best: float
    """The most likely value."""
    sigma: float
    """Its standard deviation, that of tau_m_gain included."""
    white: bool
    """Whether the innovations are, with the most likely values: if not, unknown torque may look like them."""

    @property
    def is_taken(self) -> bool:
        """Whether the log knows it better than the settings do, or contradicts them."""
        off = abs(self.best - self.before)
        contradicted = off > _CONTRADICTED * math.hypot(self.sigma, self.sigma_before)
        return self.white and (contradicted or self.sigma < self.sigma_before)

    @property
    def after(self) -> float:
        """The value to set."""
        return self.best if self.is_taken else self.before

    @property
    def sigma_after(self) -> float:
        """Its standard deviation to set."""
        return self.sigma if self.is_taken else self.sigma_before

    @property
    def verdict(self) -> str:
        """In words."""
        if not self.white:
            return "kept: innovations not white"
        return "found" if self.is_taken else "kept: the log does not determine it better"

    @property
    def assignments(self) -> dict[str, float]:
        """What to set."""
        return {self.name: self.after, f"{self.name}_sigma": self.sigma_after} if self.is_taken else {}


@dataclass(frozen=True)
class Calibration:
    """What the log says of all of them."""

    entries: tuple[Calibrated, ...]
    """Empty where they cannot be known."""
    text: str
    """That, and why."""

    @property
    def is_refused(self) -> bool:
        """Whether the log has all that is needed, but not as the model has it."""
        return any(not entry.white for entry in self.entries)

    @property
    def assignments(self) -> dict[str, float]:
        """What to set."""
        return {name: value for entry in self.entries for name, value in entry.assignments.items()}


def calibrate(likelihood: Likelihood, assignments: Assignments, kept: Sequence[str] = ()) -> Calibration:
    """Look for all of NAMES that are not `kept`, in the parts of the log in which the arm does not change.

    With a wrong calibration other changes are found than with the right one: it is looked for until they stay the same.
    """
    likelihood.leave_out_changes(assignments)
    found = _calibrate(likelihood, assignments, kept)
    for _ in range(_AGAIN):
        best = {entry.name: entry.best for entry in found.entries}
        if not best or not likelihood.leave_out_changes({**assignments, **best}):
            break
        found = _calibrate(likelihood, assignments, kept)
    return found


def _calibrate(likelihood: Likelihood, assignments: Assignments, kept: Sequence[str]) -> Calibration:
    config = make_config(assignments)
    names = tuple(name for name in NAMES if name not in kept)
    if not names:
        return Calibration((), "")
    missing = _missing(likelihood, assignments)
    if missing:
        stay = "Gain and delay of the accelerometer (z_ddot_gain, z_ddot_delay) and lever_friction stay as they are: "
        return Calibration((), stay + missing)
    entries = _Fit(likelihood, assignments, names, tuple(name for name in NOISE if name not in kept)).run()
    return Calibration(entries, _sentences(entries, config.settings[f"{TORQUE_GAIN}_sigma"]))


def dither(likelihood: Likelihood) -> float:
    """Return the rms of the motor torque in the part that is tuned on, above DITHER_FROM [N m]."""
    recording = likelihood.recording
    torque = np.where(recording.samples["tau_m_valid"], recording.samples["tau_m"], 0.0).astype(np.float64)
    high_pass = butter(2, DITHER_FROM, "highpass", fs=1.0 / recording.period, output="sos")
    return float(np.sqrt(np.mean(sosfilt(high_pass, torque)[likelihood.tuned_on] ** 2)))


# --- in words --------------------------------------------------------------------------------------------------------


def _missing(likelihood: Likelihood, assignments: Assignments) -> str:
    """Return why the calibration cannot be known; empty if it can."""
    model, torque = make_config(assignments).choices["model"], dither(likelihood)
    if model != "lever":
        return f"with model {model} they cannot be known."
    if torque < DITHER_LEAST:
        return (
            f"without dither they cannot be known. The motor torque has {rounded_down(torque, 4):g} N m rms above "
            f"{DITHER_FROM:g} Hz; {DITHER_LEAST:g} N m are needed."
        )
    if likelihood.learnt(noise_as_set(assignments)) < LEARNT_LEAST:
        return "the lever hardly moves."
    return ""


def _sentences(entries: Sequence[Calibrated], torque_sigma: float) -> str:
    if not entries[0].white:
        return (
            "The calibration stays as it is: the innovations are not white, so that the lever is moved by torque that "
            "the model does not know, which may look like a wrong gain, delay or friction."
        )
    values = ", ".join(
        f"{entry.name} {entry.best:.4g} ± {entry.sigma:.2g} {setting(entry.name).unit}".removesuffix(" 1")
        + ("" if entry.is_taken else f" ({entry.verdict})")
        for entry in entries
    )
    return (
        f"From the dither (± one standard deviation): {values}. {TORQUE_GAIN} cannot be found beside z_ddot_gain: only "
        f"the lever's own inertia tells one from the other. Its standard deviation of {100.0 * torque_sigma:.2g} % is "
        "part of these."
    )


# --- the fit ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Unknown:
    """A setting that is looked for; of noise, its logarithm."""

    name: str
    logarithmic: bool
    before: float

    @property
    def step(self) -> float:
        return _NOISE_STEP if self.logarithmic else _STEPS[self.name]

    @property
    def ends(self) -> tuple[float, float]:
        row = setting(self.name)
        return logarithmic_range(self.name, self.before) if self.logarithmic else (row.least, row.greatest)

    def number(self, value: float) -> float:
        return math.log(value) if self.logarithmic else value

    def value(self, number: float) -> float:
        return math.exp(number) if self.logarithmic else number


class _Fit:
    """The most likely values and their covariance; numbers are in the order of `unknowns`."""

    def __init__(
        self,
        likelihood: Likelihood,
        assignments: Assignments,
        names: Sequence[str],
        noise: Sequence[str],
    ) -> None:
        self._likelihood, self._names = likelihood, names
        self._base = noise_as_set(assignments)
        self._settings = make_config(assignments).settings
        tuned_noise = [name for name in noise if self._settings[name] > 0.0]
        self._unknowns = [_Unknown(name, name in tuned_noise, self._settings[name]) for name in (*names, *tuned_noise)]
        self._least, self._greatest = np.array([each.ends for each in self._unknowns]).T
        likelihood.expect("looking for the calibration", _ROUNDS // 2 * (2 * len(self._unknowns) + 1))

    def run(self) -> tuple[Calibrated, ...]:
        at = np.array([each.number(each.before) for each in self._unknowns])
        far = np.array([_FARTHEST if each.logarithmic else math.inf for each in self._unknowns])
        now = self._each(at)
        for _ in range(_ROUNDS):
            scores, gradient = self._scores(at, now)
            root = np.linalg.cholesky(self._information(scores))
            bounds = np.maximum(self._least - at, -far), np.minimum(self._greatest - at, far)
            step = lsq_linear(root.T, np.linalg.solve(root, gradient), bounds).x
            at, now, taken = self._uphill(at, now, step)
            if np.abs(taken @ root).max() < _CONVERGED:
                break
        return self._calibrated(at, self._scores(at, now)[0], now)

    def _each(self, at: Array, **others: float) -> Array:
        """Return log-likelihood of each sample that is tuned on [nat]."""
        per_sample: Array = self._innovations(at, others)["log_likelihood"]
        return per_sample

    def _is_white(self, at: Array) -> bool:
        """Return whether the innovations are, of theta_dot or, if that is not measured, of theta."""
        innovations = self._innovations(at, {}, everywhere=True)
        output = 1 if innovations["sigma"][:, 1].any() else 0
        used = (innovations["sigma"][:, output] > 0.0) & self._likelihood.tuned_on
        values = np.where(used, innovations["value"][:, output], np.nan)  # what is left out is missing
        measured = whiteness.measure(values.astype(np.float64), self._likelihood.recording.period)
        return measured is None or measured.white

    def _innovations(self, at: Array, others: Mapping[str, float], everywhere: bool = False) -> Array:
        """Return the innovations of the part that is tuned on, or of all."""
        values = {each.name: each.value(float(x)) for each, x in zip(self._unknowns, at, strict=True)}
        delay = values.pop("z_ddot_delay", self._settings["z_ddot_delay"])
        everything = {**self._base, **values, **others, "z_ddot_delay": 0.0}
        innovations: Array = self._likelihood.run(everything, delay)
        return innovations if everywhere else innovations[self._likelihood.tuned_on]

    def _scores(self, at: Array, now: Array) -> tuple[Array, Array]:
        """Return the derivative of `now`, a column for each unknown, and their sum, by differences to both sides.

        A difference is halfway to its other end, where the sum is less by half a step of information.
        """
        columns, gradient = [], []
        for i, each in enumerate(self._unknowns):
            sides = [h for h in (each.step, -each.step) if self._least[i] <= at[i] + h <= self._greatest[i]]
            slopes = [(self._each(at + h * np.eye(len(at))[i]) - now) / h for h in sides]
            best = _smaller(slopes)
            columns.append(slopes[best])
            gradient.append(slopes[best].sum() + 0.5 * sides[best] * float(slopes[best] @ slopes[best]))
        return np.stack(columns, axis=1), np.array(gradient)

    def _information(self, scores: Array) -> Array:
        """With that of the ranges, next to nothing, so that it has an inverse."""
        information: Array = scores.T @ scores + np.diag((self._greatest - self._least) ** -2.0)
        return information

    def _uphill(self, at: Array, now: Array, step: Array) -> tuple[Array, Array, Array]:
        """Where the log is more likely, on the way of a step: there, its log-likelihoods, and the step taken."""
        for part in (1.0, 0.5, 0.25, 0.1):
            there = np.clip(at + part * step, self._least, self._greatest)
            each = self._each(there)
            if each.sum() > now.sum():
                return there, each, part * step
        return at, now, 0.0 * step

    def _calibrated(self, at: Array, scores: Array, now: Array) -> tuple[Calibrated, ...]:
        """Return what was found of each, with a standard deviation that contains that of tau_m_gain.

        The log says nothing of tau_m_gain: as in a Schmidt-Kalman filter, it is considered, not estimated.
        """
        torque_sigma, h = self._settings[f"{TORQUE_GAIN}_sigma"], _STEPS[TORQUE_GAIN]
        covariance = np.linalg.inv(self._information(scores))
        if torque_sigma > 0.0:
            gain = self._settings[TORQUE_GAIN]
            slopes = [(self._each(at, **{TORQUE_GAIN: gain + side}) - now) / side for side in (h, -h)]
            shift = covariance @ (scores.T @ slopes[_smaller(slopes)]) * torque_sigma
            covariance += np.outer(shift, shift)
        sigma, white = np.sqrt(np.diag(covariance)), self._is_white(at)
        return tuple(
            Calibrated(
                name,
                self._settings[name],
                self._settings[f"{name}_sigma"],
                float(f"{at[i]:.4g}") if abs(at[i]) > _NOTHING * sigma[i] else 0.0,
                float(f"{sigma[i]:.2g}"),
                white,
            )
            for i, name in enumerate(self._names)
        )


def _smaller(slopes: Sequence[Array]) -> int:
    """Return which of two differences, to either side, has the smaller sum of squares.

    A change of the pilot that is detected on one side alone would look like information.
    """
    return int(np.argmin([float(column @ column) for column in slopes]))
