"""State filter and parameter filter in step, as the firmware runs them, in another form than the firmware's.

Parameters are filtered as w = ln(p / first guess), so they stay positive and a random walk of w is a relative one. The
state x has its own factor S for given parameters; V = dx/dw, shape (2, 3), is how the state estimate moves with the
parameters (the recurrent derivative of A. Nelson, "Nonlinear estimation and modeling of noisy time series by dual
Kalman filtering methods", PhD thesis, OGI 2000; the blending matrix of B. Friedland, "Treatment of bias in recursive
filtering", IEEE TAC 14 (1969)). One step with the inputs u between the samples and the outputs y at the new one, and
T = V S_w:

In preload trim all signals are deviations from their levels (detrend), so x is, too; in preload fixed they are as they
come.

    points      x̂ ± h S at ŵ;  (x̂ ± h T_j, ŵ ± h S_w,j);  f at all of them gives x̂⁻, S⁻ (with the second differences of
                the latter) and, by first differences, T⁻
    walk        P_w⁻ = P_w + q dt;  the covariance of x and w, T⁻ S_wᵀ, stays: V⁻ = T⁻ S_wᵀ (P_w⁻)⁻¹
    state       ν = y - H x̂⁻;  S_e = tria[H S⁻, S_n];  K = S⁻ S⁻ᵀ Hᵀ (S_e S_eᵀ)⁻¹;  V = (I - K H) V⁻
    parameters  update of ŵ, S_w with the output H V⁻ w, whose noise has the factor S_e;  x̂ = x̂⁻ + K ν + V Δw

The firmware carries T as extra rows of S_w through Carlson's and Givens' rotations; here are full matrices, QR, and V.
q [1/s] is the variance rate of the random walk, which the adaptation sets.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import cdkf
from .cdkf import Array
from .detrend import Detrend
from .lever import Lever

PARAMETERS = ("m_p", "c_p", "k_p")
ADAPTATIONS = ("fixed", "annealing", "robbins_monro")
OUTAGE = 0.0205  # [s] an output missing for longer is out
MOST_SUBSTEPS = 16  # predictions through a gap
UNBOUNDED = np.array([[0.0, math.inf]] * len(PARAMETERS))


@dataclass(frozen=True)
class Start:
    """Where the dual filter starts: the first guess of the parameters is always the settings'."""

    state: Array  # (2,) [rad, rad/s]
    state_factor: Array  # (2, 2)
    trim: float  # [rad]
    input: tuple[float, float] = (0.0, 0.0)  # z̈ [m/s²], τ_m [N m] at that sample
    time: float = 0.0  # [s]


class DualFilter:
    """The dual square-root CDKF. `settings` are those of firmware/lever_settings.def, by name.

    `bounds` (3, 2) are the model's least and greatest m_p, c_p, k_p in physical units.
    """

    def __init__(
        self,
        settings: Mapping[str, float],
        start: Start,
        preload: str = "trim",
        adaptation: str = "robbins_monro",
        bounds: Array = UNBOUNDED,
    ) -> None:
        if adaptation not in ADAPTATIONS:
            raise ValueError(f'adaptation: "{adaptation}" is none of {", ".join(ADAPTATIONS)}')
        self.settings = settings
        self.adaptation = adaptation
        self.lever = Lever.from_settings(settings, preload)
        self.detrended = preload == "trim"
        self.first_guess = np.array([settings[name] for name in PARAMETERS])
        self.cap = np.array([settings[f"{name}_sigma"] for name in PARAMETERS])
        self.floor = np.array([settings[f"{name}_walk"] for name in PARAMETERS]) ** 2
        self.ceiling = self.floor * settings["walk_ceiling"] ** 2
        self.process_noise = (settings["theta_process_noise"], settings["theta_dot_process_noise"])
        self.output_noise = np.diag([settings["theta_noise"], settings["theta_dot_noise"]])
        with np.errstate(divide="ignore"):
            self.bounds = np.log(bounds / self.first_guess[:, np.newaxis])

        self.x = start.state.astype(np.float64)
        self.x_factor = start.state_factor.astype(np.float64)
        self.w = np.zeros(len(PARAMETERS))
        self.w_factor = np.diag(self.cap)
        self.v: Array = np.zeros((2, len(PARAMETERS)))  # dx/dw
        self.walk = (self.ceiling if adaptation == "annealing" else self.floor).copy()  # q [1/s]
        self.outputs = (Detrend(start.trim), Detrend())  # θ, whose level is the trim angle, and θ̇
        self.inputs = (Detrend(), Detrend())  # z̈, τ_m
        self.origin = np.zeros(2)  # what x counts from: in preload trim the levels
        if self.detrended:
            self.origin = np.array((start.trim, 0.0))
            self.x = self.x - self.origin
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
        dt, nothing = duration / substeps, np.zeros(2, np.bool_)
        for i in range(1, substeps + 1):
            share = i / substeps
            self._advance(tuple(old + share * (new - old) for old, new in zip(self.last_raw, u, strict=True)), dt)
            if i < substeps:
                self._refer(y, nothing, dt)
        self.time, self.last_raw = time, u
        y, back = self._refer(y, valid, dt)
        if back:
            self._end_outage(y, valid)
        self.nis = 0.0
        if valid.any():
            correction = self._update(y, valid, learn=self.unsettled < 0.5 * self.settings["sample_period"])
            if correction is not None:
                self._adapt_walk(correction, duration)
                self.w = np.clip(self.w, self.bounds[:, 0], self.bounds[:, 1])
        self.unsettled -= duration
        self._follow(duration)

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

    def _refer(self, y: Array, valid: NDArray[np.bool_], dt: float) -> tuple[Array, bool]:
        """The outputs as x counts them, and whether one is back after an outage.

        A level follows the prediction through a few missing samples, then waits.
        """
        referred, back = np.zeros(2), False
        for i, detrend in enumerate(self.outputs):
            waiting = self.missing[i] > OUTAGE
            if valid[i]:
                referred[i] = self._deviation(detrend, float(y[i]), dt)
                back = back or waiting
                self.missing[i] = 0.0
                continue
            self.missing[i] += dt
            if waiting:
                detrend.slope = 0.0
            else:
                self._deviation(detrend, float(self.origin[i] + self.x[i]), dt)
        return referred, back

    def _end_outage(self, y: Array, valid: NDArray[np.bool_]) -> None:
        """The state starts again where it is measured; levels must settle before anything can be learnt."""
        if valid.all():
            self.x, self.x_factor, self.v = y, self.output_noise.copy(), np.zeros((2, len(PARAMETERS)))
        self._wait_for_levels()

    def _wait_for_levels(self) -> None:
        self.unsettled = 1.0 / self.settings["trim_corner"] if self.detrended else 0.0  # [s]

    def _predict(self, u: tuple[float, float], dt: float) -> None:
        states = cdkf.draw(self.x, self.x_factor)
        pairs = cdkf.draw(np.concatenate((self.x, self.w)), np.concatenate((self.v @ self.w_factor, self.w_factor)))
        moved_states = self._move(states, self.w[:, np.newaxis], u, dt)
        moved_pairs = self._move(pairs[:2], pairs[2:], u, dt)
        mean, first, second = cdkf.differences(moved_states)
        along_w, t, bent = cdkf.differences(moved_pairs)
        self.x = mean + along_w - moved_states[:, 0]  # the curvature along the parameters counts, too
        self.x_factor = cdkf.tria(np.concatenate((first, second, bent, self._process_noise(dt)), axis=1))
        self._walk(t, dt)

    def _process_noise(self, dt: float) -> Array:
        """Factor (2, 3) of an integrated random walk of θ̇ (its covariance: van Loan 1978) plus a random walk of θ."""
        own, rate = self.process_noise
        return math.sqrt(dt) * np.array([[own, rate * dt / 2.0, rate * dt / math.sqrt(12.0)], [0.0, rate, 0.0]])

    def _walk(self, t: Array, dt: float) -> None:
        """The random walk of w; no parameter becomes less certain than at the start, or it would wind up unexcited."""
        cross = t @ self.w_factor.T
        self.w_factor = cdkf.tria(np.concatenate((self.w_factor, np.diag(np.sqrt(self.walk * dt))), axis=1))
        kept = np.linalg.solve(self.w_factor, cross.T).T
        shrink = np.minimum(self.cap / cdkf.deviations(self.w_factor), 1.0)
        self.w_factor = self.w_factor * shrink[:, np.newaxis]
        self.v = np.linalg.solve(self.w_factor.T, kept.T).T

    def _move(self, x: Array, w: Array, u: tuple[float, float], dt: float) -> Array:
        """f: the states (2, N) after `dt` [s]; the trim is where it was at the last sample."""
        trim = self.outputs[0].level
        angle = np.array(((trim if self.detrended else 0.0,), (0.0,)))
        p = self.first_guess[:, np.newaxis] * np.exp(w)
        moved: Array = self.lever.step(x + angle, p, u, trim, dt) - angle
        return moved

    def _update(self, y: Array, valid: NDArray[np.bool_], learn: bool) -> Array | None:
        """Takes the valid outputs; returns the correction of w, or None when w is held."""
        noise = self.output_noise[np.ix_(valid, valid)]
        state = cdkf.measure(self.x, self.x_factor, lambda x: x[valid], noise)
        innovation = y[valid] - state.mean
        output = self.v[valid]
        gain = cdkf.gain(self.x_factor, state)
        self.x, self.x_factor = cdkf.update(self.x, self.x_factor, state, gain, innovation)
        self.v = self.v - gain @ output
        if not learn:
            self.nis = cdkf.normalised_square(state.factor, innovation)
            return None

        parameters = cdkf.measure(self.w, self.w_factor, lambda w: output @ (w - self.w[:, np.newaxis]), state.factor)
        self.nis = cdkf.normalised_square(parameters.factor, innovation)
        gain = cdkf.gain(self.w_factor, parameters)
        self.w, self.w_factor = cdkf.update(self.w, self.w_factor, parameters, gain, innovation)
        correction: Array = gain @ innovation
        self.x = self.x + self.v @ correction
        return correction

    # --- what keeps the parameter filter awake, and in bounds -------------------------------------------------------

    def _adapt_walk(self, correction: Array, duration: float) -> None:
        """Sets q for the next step from this step's correction of w, K ν."""
        if self.adaptation == "fixed":
            return
        if math.sqrt(self.excitation_square) < self.settings["excitation_least"]:
            self.walk = self.floor.copy()  # nothing to learn from: no more uncertainty than the pilot's own changes
        elif self.adaptation == "annealing":
            self.walk = np.maximum(self.walk * math.exp(-duration / self.settings["annealing_time"]), self.floor)
        else:  # Robbins and Monro 1951: a running average of what the corrections say the walk is
            nu = duration / self.settings["robbins_monro_time"]
            self.walk = np.clip((1.0 - nu) * self.walk + nu * correction**2 / duration, self.floor, self.ceiling)

    def _follow(self, duration: float) -> None:
        """The mean square of the rate."""
        share = min(duration / self.settings["excitation_time"], 1.0)
        self.excitation_square += share * (float(self.x[1]) ** 2 - self.excitation_square)

    # --- what is known ---------------------------------------------------------------------------------------------

    @property
    def trim(self) -> float:
        """The trim angle [rad]."""
        return self.outputs[0].level

    def state_deviations(self) -> Array:
        """Standard deviations of θ [rad] and θ̇ [rad/s], the uncertainty of the parameters included."""
        return cdkf.deviations(np.concatenate((self.x_factor, self.v @ self.w_factor), axis=1))

    def parameters(self) -> tuple[Array, Array]:
        """m_p [kg], c_p [N s/m], k_p [N/m] and their standard deviations (first order: σ_p = p σ_w)."""
        p = self.first_guess * np.exp(self.w)
        return p, p * cdkf.deviations(self.w_factor)

    def dynamics(self) -> tuple[Array, Array]:
        """Natural frequency [Hz] and damping ratio [1] of the estimate; standard deviations by sigma points."""
        points = self.first_guess[:, np.newaxis] * np.exp(cdkf.draw(self.w, self.w_factor))
        values = self.lever.dynamics(points, self.trim)
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


COLUMNS = (
    *("theta", "theta_dot", "theta_sigma", "theta_dot_sigma"),
    *(*PARAMETERS, *(f"{name}_sigma" for name in PARAMETERS)),
    *("natural_frequency", "damping_ratio", "natural_frequency_sigma", "damping_ratio_sigma"),
    *("trim", "nis"),
)


def run(dual: DualFilter, samples: Mapping[str, Array], first: int = 0) -> dict[str, Array]:
    """Steps `dual` through the samples from index `first` on and returns one array of estimates for each of COLUMNS.

    `samples`: time_s, theta, theta_dot, z_ddot, tau_m and theta_valid, theta_dot_valid, each of shape (N,); an invalid
    tau_m must already be 0 and an invalid z_ddot the last valid one.
    """
    count = len(samples["time_s"])
    table = np.empty((count - first, len(COLUMNS)))
    y = np.column_stack((samples["theta"], samples["theta_dot"]))
    valid = np.column_stack((samples["theta_valid"], samples["theta_dot_valid"])).astype(bool)
    time, base, torque = (samples[name].tolist() for name in ("time_s", "z_ddot", "tau_m"))
    for row, index in enumerate(range(first, count)):
        dual.step(time[index], y[index], valid[index], (base[index], torque[index]))
        known = (dual.origin + dual.x, dual.state_deviations(), *dual.parameters(), *dual.dynamics())
        table[row] = np.concatenate((*known, (dual.trim, dual.nis)))
    return dict(zip(COLUMNS, table.T.copy(), strict=True))
