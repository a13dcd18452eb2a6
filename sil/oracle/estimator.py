"""The estimator as the firmware runs it: a belief (belief.py), when it learns and walks, trim, gaps, alignment.

In preload trim all signals are deviations from their levels (detrend), so x is, too; in preload fixed they are as they
come. Once every learn_period the parameters learn what is pending, forget, and walk; how they walk next is set by the
adaptation. Change detection and noise estimation are not repeated here: compare with the settings change_threshold and
noise_window at 0.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import cdkf
from .belief import Augmented, Belief, TwoStage
from .cdkf import Array
from .detrend import Detrend
from .lever import Lever
from .linear import LinearBlackBox, LinearPhysical
from .scale import Scale

ADAPTATIONS = ("fixed", "annealing", "robbins_monro", "forgetting")
ESTIMATORS = ("dual", "joint", "augmented")
OUTAGE = 0.0205  # [s] an output missing for longer is out
MOST_SUBSTEPS = 12  # predictions through a gap
UNBOUNDED = np.array([[-math.inf, math.inf]] * 3)

Model = Lever | LinearPhysical | LinearBlackBox


def model_of(settings: Mapping[str, float], name: str, preload: str) -> Model:
    """The model of that name in firmware/lever_settings.def."""
    if name == "lever":
        return Lever.from_settings(settings, preload)
    rest = settings["lever_preload_angle"]
    return LinearPhysical(rest, preload) if name == "linear_physical" else LinearBlackBox(rest, preload)


@dataclass(frozen=True)
class Start:
    """Where the estimator starts: the first guess of the parameters is always the settings'."""

    state: Array  # (2,) [rad, rad/s]
    state_factor: Array  # (2, 2)
    trim: float  # [rad]
    input: tuple[float, float] = (0.0, 0.0)  # z̈ [m/s²], τ_m [N m] at that sample
    time: float = 0.0  # [s]


class Estimator:
    """The square-root CDKF for state and parameters. `settings` are those of firmware/lever_settings.def, by name.

    `estimator`: "dual" or "joint", as in the firmware; "augmented", the textbook's joint filter, which learns from
    every sample at once, and without caution. `bounds` (3, 2) are the model's least and greatest parameters in physical
    units.
    """

    def __init__(
        self,
        settings: Mapping[str, float],
        start: Start,
        preload: str = "trim",
        adaptation: str = "robbins_monro",
        bounds: Array = UNBOUNDED,
        model: str = "lever",
        estimator: str = "dual",
    ) -> None:
        for what, name, choices in (("adaptation", adaptation, ADAPTATIONS), ("estimator", estimator, ESTIMATORS)):
            if name not in choices:
                raise ValueError(f'{what}: "{name}" is none of {", ".join(choices)}')
        self.settings = settings
        self.adaptation = adaptation
        self.scale = Scale.from_settings(settings, model)
        self.model = model_of(settings, model, preload)
        self.detrended = preload == "trim"
        self.floor = self.scale.walk
        self.ceiling = self.floor * settings["walk_ceiling"] ** 2
        self.greatest_sigma = self.scale.sigma
        self.process_noise = (settings["theta_process_noise"], settings["theta_dot_process_noise"])
        self.output_noise = np.diag([settings["theta_noise"], settings["theta_dot_noise"]])
        self.bounds = self.scale.scaled(bounds)

        self.outputs = (Detrend(start.trim), Detrend())  # θ, whose level is the trim angle, and θ̇
        self.inputs = (Detrend(), Detrend())  # z̈, τ_m
        self.origin = np.array((start.trim, 0.0)) if self.detrended else np.zeros(2)  # what x counts from
        x = start.state.astype(np.float64) - self.origin
        x_factor, w_factor = start.state_factor.astype(np.float64), np.diag(self.scale.sigma)
        self.belief: Belief = (
            Augmented(w_factor, x, x_factor)
            if estimator == "augmented"
            else TwoStage(w_factor, x, x_factor, joint=estimator == "joint")
        )
        self.walk = (self.ceiling if adaptation == "annealing" else self.floor).copy()  # q [1/s]
        self.growth = self._growth(excited=True)  # [1/s]
        self.elapsed = 0.0  # since the parameters learnt last [s]
        self.trust = 0.0  # part of the information that counts
        self.excitation_square = 4.0 * settings["excitation_least"] ** 2  # [(rad/s)²], presumed until measured
        self.nis = 0.0
        self.missing = [0.0, 0.0]  # time since the last sample of θ, of θ̇ [s]
        self._wait_for_levels()
        self.last_raw = start.input
        self.last_input = start.input  # the same, as deviations in preload trim
        self.time = start.time

    # --- one sample ------------------------------------------------------------------------------------------------

    def step(self, time: float, y: Array, valid: NDArray[np.bool_], u: tuple[float, float]) -> None:
        """Takes the sample at `time` [s]: outputs y = [θ, θ̇] of which those flagged are used, inputs u = (z̈, τ_m)."""
        duration = time - self.time
        substeps = min(max(1, round(duration / self.settings["sample_period"])), MOST_SUBSTEPS)
        dt, none_valid = duration / substeps, np.zeros(2, np.bool_)
        for i in range(1, substeps + 1):
            share = i / substeps
            self._advance(tuple(old + share * (new - old) for old, new in zip(self.last_raw, u, strict=True)), dt)
            if i < substeps:
                self._subtract_trim(y, none_valid, dt)
        self.time, self.last_raw = time, u
        y, back = self._subtract_trim(y, valid, dt)
        if back:
            self._end_outage(y, valid)
        settled = self.unsettled < 0.5 * self.settings["sample_period"]
        excited = math.sqrt(self.excitation_square) >= self.settings["excitation_least"]
        self.nis = 0.0
        if valid.any():
            self.nis = self.belief.update(y, valid, self.output_noise, learn=settled and excited)
        self._learn_when_due(duration, teaches=settled and bool(valid.any()), excited=excited)
        self.unsettled -= duration
        self._average_excitation(duration)

    def _advance(self, raw: tuple[float, ...], dt: float) -> None:
        """One prediction, with the mean of the inputs at both ends."""
        u = (self._deviation(self.inputs[0], raw[0], dt), self._deviation(self.inputs[1], raw[1], dt))
        if self.detrended:
            self.origin = np.array([detrend.level for detrend in self.outputs])
        self._predict((0.5 * (u[0] + self.last_input[0]), 0.5 * (u[1] + self.last_input[1])), dt)
        self.last_input = u

    def _deviation(self, detrend: Detrend, value: float, dt: float) -> float:
        deviation = detrend.step(value, self.settings["trim_corner"], dt)
        return deviation if self.detrended else value

    def _subtract_trim(self, y: Array, valid: NDArray[np.bool_], dt: float) -> tuple[Array, bool]:
        """The outputs without their slow level, as x is in preload trim, and whether one is back after an outage.

        A level follows the prediction through a few missing samples, then waits.
        """
        deviation, back = np.zeros(2), False
        for i, detrend in enumerate(self.outputs):
            waiting = self.missing[i] > OUTAGE
            if valid[i]:
                deviation[i] = self._deviation(detrend, float(y[i]), dt)
                back = back or waiting
                self.missing[i] = 0.0
                continue
            self.missing[i] += dt
            if waiting:
                detrend.slope = 0.0
            else:
                self._deviation(detrend, float(self.origin[i] + self.belief.x[i]), dt)
        return deviation, back

    def _end_outage(self, y: Array, valid: NDArray[np.bool_]) -> None:
        """The state starts again where it is measured; levels must settle before anything can be learnt."""
        if valid.all():
            self.belief.start_state(y, self.output_noise)
        self._wait_for_levels()

    def _wait_for_levels(self) -> None:
        self.unsettled = 1.0 / self.settings["trim_corner"] if self.detrended else 0.0  # [s]

    def _predict(self, u: tuple[float, float], dt: float) -> None:
        """The trim is where it was at the last sample."""
        trim = self.outputs[0].level
        angle = np.array(((trim if self.detrended else 0.0,), (0.0,)))

        def motion(x: Array, w: Array) -> Array:
            moved: Array = self.model.step(x + angle, self.scale.physical(w), u, trim, dt) - angle
            return moved

        self.belief.predict(motion, self._process_noise(dt))

    def _process_noise(self, dt: float) -> Array:
        """Factor (2, 3) of an integrated random walk of θ̇ (its covariance: van Loan 1978) plus a random walk of θ."""
        own, rate = self.process_noise
        return math.sqrt(dt) * np.array([[own, rate * dt / 2.0, rate * dt / math.sqrt(12.0)], [0.0, rate, 0.0]])

    # --- when the parameters learn, and how they walk ----------------------------------------------------------------

    def _learn_when_due(self, duration: float, teaches: bool, excited: bool) -> None:
        """Once every learn_period; a sample that is half a sample_period early is on time."""
        self.elapsed += duration
        if self.elapsed > self.settings["learn_period"] - 0.5 * self.settings["sample_period"]:
            self._learn(self.elapsed, teaches, excited)
            self.elapsed = 0.0

    def _learn(self, period: float, teaches: bool, excited: bool) -> None:
        """At first information counts in part: far from the truth the sensitivities are wrong."""
        if self.belief.pending:
            caution = self.settings["caution_time"]
            self.trust = min(self.trust + (period / caution if caution > period else 1.0), 1.0)
        correction = self.belief.learn(self.trust)
        self.belief.bound(self.bounds[:, 0], self.bounds[:, 1])
        self.belief.forget(self.growth * period)
        self.belief.walk(self.walk * period)
        self.belief.limit(self.greatest_sigma)
        if teaches:
            self._adapt_walk(correction, period, excited)
        else:
            self.growth = 0.0  # what cannot be learnt again is not forgotten

    def _growth(self, excited: bool) -> float:
        """Forgetting: the covariance grows by 1/λ = 1 + growth dt."""
        return 1.0 / self.settings["forgetting_time"] if excited and self.adaptation == "forgetting" else 0.0

    def _adapt_walk(self, correction: Array, period: float, excited: bool) -> None:
        """Sets q and growth for the next time from the last correction of w, `period` [s] after the one before."""
        self.growth = self._growth(excited)
        if not excited:
            self.walk = self.floor.copy()  # nothing to learn from: no more uncertainty than the pilot's own changes
        elif self.adaptation == "annealing":
            self.walk = np.maximum(self.walk * math.exp(-period / self.settings["annealing_time"]), self.floor)
        elif self.adaptation == "robbins_monro":  # 1951: a running average of what the corrections say the walk is
            nu = min(period / self.settings["robbins_monro_time"], 1.0)
            self.walk = np.clip((1.0 - nu) * self.walk + nu * correction**2 / period, self.floor, self.ceiling)

    def _average_excitation(self, duration: float) -> None:
        """The mean square of the rate."""
        share = min(duration / self.settings["excitation_time"], 1.0)
        self.excitation_square += share * (float(self.belief.x[1]) ** 2 - self.excitation_square)

    # --- estimates -------------------------------------------------------------------------------------------------

    @property
    def trim(self) -> float:
        """The trim angle [rad]."""
        return self.outputs[0].level

    def state_deviations(self) -> Array:
        """Standard deviations of θ [rad] and θ̇ [rad/s], the uncertainty of the parameters included."""
        return cdkf.deviations(self.belief.joint_factor[len(self.scale.names) :])

    def parameters(self) -> tuple[Array, Array]:
        """The model's parameters in its units, and their standard deviations to first order."""
        w = self.belief.w
        return self.scale.physical(w), self.scale.slope(w) * cdkf.deviations(self.belief.w_factor)

    def dynamics(self) -> tuple[Array, Array]:
        """Natural frequency [Hz] and damping ratio [1] of the estimate; standard deviations by sigma points."""
        points = self.scale.physical(cdkf.draw(self.belief.w, self.belief.w_factor))
        values = self.model.dynamics(points, self.trim)
        _, first, second = cdkf.differences(values)
        return values[:, 0], cdkf.deviations(np.concatenate((first, second), axis=1))


# --- a whole run -----------------------------------------------------------------------------------------------------


def align(samples: Mapping[str, Array], settings: Mapping[str, float]) -> tuple[Start, int]:
    """Where the firmware starts after `align_time`, and how many samples that took (at least one).

    The trim is the mean angle; the state is the last sample, as uncertain as its noise. Raises ValueError if that
    sample is not valid, for then the firmware goes on aligning.
    """
    time = samples["time_s"]
    last = int(np.searchsorted(time, time[0] + settings["align_time"] - 0.5 * settings["sample_period"]))
    if not (samples["theta_valid"][last] and samples["theta_dot_valid"][last]):
        raise ValueError(f"align: theta or theta_dot is not valid at {time[last]} s, the end of align_time")
    theta = samples["theta"][: last + 1][samples["theta_valid"][: last + 1].astype(bool)]
    state = np.array((samples["theta"][last], samples["theta_dot"][last]))
    factor = np.diag((settings["theta_noise"], settings["theta_dot_noise"]))
    inputs = (float(samples["z_ddot"][last]), float(samples["tau_m"][last]))
    return Start(state, factor, float(theta.mean()), inputs, float(time[last])), last + 1


def columns(estimator: Estimator) -> tuple[str, ...]:
    """Of what `run` returns."""
    names = estimator.scale.names
    return (
        *("theta", "theta_dot", "theta_sigma", "theta_dot_sigma"),
        *(*names, *(f"{name}_sigma" for name in names)),
        *("natural_frequency", "damping_ratio", "natural_frequency_sigma", "damping_ratio_sigma"),
        *("trim", "nis"),
    )


def run(estimator: Estimator, samples: Mapping[str, Array], first: int = 0, every: int = 1) -> dict[str, Array]:
    """Steps through the samples from index `first` on; estimates after every `every`th of them, an array a column.

    `samples`: time_s, theta, theta_dot, z_ddot, tau_m and theta_valid, theta_dot_valid, each of shape (N,); an invalid
    tau_m must already be 0 and an invalid z_ddot the last valid one.
    """
    rows = []
    y = np.column_stack((samples["theta"], samples["theta_dot"]))
    valid = np.column_stack((samples["theta_valid"], samples["theta_dot_valid"])).astype(bool)
    time, base, torque = (samples[name].tolist() for name in ("time_s", "z_ddot", "tau_m"))
    for index in range(first, len(time)):
        estimator.step(time[index], y[index], valid[index], (base[index], torque[index]))
        if (index - first) % every == 0:
            x = (estimator.origin + estimator.belief.x, estimator.state_deviations())
            others = (*estimator.parameters(), *estimator.dynamics(), (estimator.trim, estimator.nis))
            rows.append(np.concatenate((*x, *others)))
    return dict(zip(columns(estimator), np.array(rows).T, strict=True))
